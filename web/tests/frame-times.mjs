// Times between frames of the page: `node tests/frame-times.mjs [Hz] [seconds]`. The scope with eight signals, Friction Design
// and Test during a motion. A browser without a GPU draws on the processors that also run the bench.

import { loadavg } from 'node:os'
import { caller, play, state } from './harness.mjs'

const [rate, seconds] = [4000, 15].map((usual, i) => Number(process.argv[2 + i] ?? usual))

/** Times between the frames of the next seconds [ms]. */
const frames = (seconds) =>
  new Promise((resolve) => {
    const times = []
    let [first, before] = [0, 0]
    const next = (now) => {
      if (before) times.push(now - before)
      first ||= now
      before = now
      if (now - first > 1000 * seconds) resolve(times)
      else requestAnimationFrame(next)
    }
    requestAnimationFrame(next)
  })

await play(async (scene) => {
  const page = await scene.page('Ann')
  const call = caller(page)
  const idle = async () => {
    do await page.waitForTimeout(200)
    while ((await call({ call: 'status' })).doing)
  }
  const measure = async (what) => {
    await page.waitForTimeout(1000)
    const times = (await page.evaluate(frames, seconds)).sort((a, b) => a - b)
    const at = (share) => times[Math.min(times.length - 1, Math.floor(share * times.length))].toFixed(1)
    console.log(`${what}: ${(times.length / seconds).toFixed(1)} frames/s, median ${at(0.5)} ms, p95 ${at(0.95)} ms, longest ${at(1)} ms; load of the machine ${loadavg()[0].toFixed(1)}`)
  }
  const open = async (path) => {
    await page.goto(scene.bench.address.origin + path)
    await page.getByRole('main').waitFor()
  }
  await page.goto(scene.bench.address.href)
  await state(page).getByText('Off').waitFor()
  await call({ call: 'home' })
  await idle()
  const move = () => call({ call: 'move', reference: 'sine', values: { amplitude: 2, frequency: 1 } })

  const names = (await call({ call: 'signals' })).signals.map((signal) => signal.name)
  const wanted = ['angle', 'setpoint_position', 'estimated_velocity', 'setpoint_velocity', 'commanded_torque', 'measured_load_torque']
  const chosen = [...new Set([...wanted, ...names])].filter((name) => names.includes(name)).slice(0, 8)
  const panes = [0, 4].map((from) => ({ kind: 'time', names: chosen.slice(from, from + 4) }))
  await page.evaluate((panes) => localStorage.setItem('stickslip.scope', JSON.stringify({ span: 10, panes })), panes)
  await move()
  await open('/scope')
  await measure(`scope, ${chosen.length} signals, ${rate} Hz, 10 s, axis moving`)
  await open('/design')
  await measure('Friction Design, axis moving')
  await open('/test')
  await measure('Test during a motion')
  await page.keyboard.press('s')
  await measure('Test during a motion, scope open')
}, [`bench.tick_rate=${rate}`, 'bench.safety.missed_ticks=500'])
