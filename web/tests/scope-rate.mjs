// Load test of the scope: `node tests/scope-rate.mjs [signals] [Hz] [seconds]`. All signals in panes of four, in a separate
// window. Prints frames per second, time per frame, memory, and lost and missed cycles.

import { play } from './harness.mjs'

const [signals, rate, seconds] = [26, 10_000, 60].map((usual, i) => Number(process.argv[2 + i] ?? usual))

await play(async (scene) => {
  const page = await scene.page('Ann', { width: 1440, height: 900 })
  await page.goto(scene.bench.address.href)
  const available = await page.evaluate(async () => {
    const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: '{"call":"signals"}' })
    return (await response.json()).signals.map((signal) => signal.name)
  })
  const names = available.slice(0, signals)
  const panes = []
  for (let i = 0; i < names.length; i += 4) panes.push({ kind: 'time', names: names.slice(i, i + 4) })
  await page.evaluate((panes) => localStorage.setItem('stickslip.scope', JSON.stringify({ span: 10, panes })), panes)
  await page.goto(`${scene.bench.address.origin}/scope`)
  const session = await page.context().newCDPSession(page)
  await session.send('Performance.enable')
  await page.getByRole('region', { name: /^Pane/ }).first().waitFor()
  const about = page.getByRole('region', { name: 'Scope', exact: true }).locator('.about')
  console.log(`${names.length} signals, ${rate} Hz, a view of 10 s`)
  const memory = async () => {
    const { usedSize, backingStorageSize } = await session.send('Runtime.getHeapUsage')
    return `heap ${(usedSize / 1e6).toFixed(1)} MB, samples ${((backingStorageSize ?? 0) / 1e6).toFixed(0)} MB`
  }
  for (let at = 0; at < seconds; at += 10) {
    const start = await page.evaluate(() => performance.now())
    const rates = await page.evaluate(
      () =>
        new Promise((resolve) => {
          let [frames, first, before, longest] = [0, 0, 0, 0]
          const next = (now) => {
            if (first) longest = Math.max(longest, now - before)
            first ||= now
            before = now
            if (now - first > 9000) return resolve({ rate: (1000 * frames) / (now - first), longest })
            frames += 1
            requestAnimationFrame(next)
          }
          requestAnimationFrame(next)
        }),
    )
    const left = 10_000 - ((await page.evaluate(() => performance.now())) - start)
    await page.waitForTimeout(Math.max(0, left))
    const { clock } = await page.evaluate(async () => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: '{"call":"status"}' })
      return response.json()
    })
    await page.keyboard.press('Control+k')
    await page.keyboard.type('Frame times')
    await page.keyboard.press('Enter')
    const message = page.getByText(/frames per second/)
    const each = /[\d.]+ ms/.exec(await message.innerText())[0]
    await page.getByRole('button', { name: /Dismiss|Close/ }).first().click()
    console.log(`${String(at + 10).padStart(4)} s: ${rates.rate.toFixed(1)} frames/s of ${each}, longest pause ${rates.longest.toFixed(0)} ms, ${await memory()}, ${await about.innerText()}, lost ${clock.lost}, missed ${clock.held}`)
  }
}, [`bench.tick_rate=${rate}`, 'bench.safety.missed_ticks=500'])
