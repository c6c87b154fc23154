// Effect of browsers on the loop, as numbers: `node tests/browsers.mjs [browsers] [seconds] [turns]`. Each turn starts a bench at
// the rate of its preset, alternately without and with browsers that show the moving axis, and prints the lateness of cycles.

import { play } from './harness.mjs'

const [browsers, seconds, turns] = [4, 40, 3].map((usual, i) => Number(process.argv[2 + i] ?? usual))
const us = (time) => (1e6 * time).toFixed(1).padStart(9)
const cpu = process.env.CPU ? ['--cpu', process.env.CPU] : []

console.log('browsers   p50 us    p99 us  p99.9 us  missed of cycles, lost')
for (let turn = 0; turn < turns; turn += 1)
  for (const pages of turn % 2 ? [browsers, 0] : [0, browsers])
    await play(async (scene) => {
      const call = async (body) => {
        const response = await fetch(new URL('/api', scene.bench.address), {
          method: 'POST',
          headers: { 'Content-Type': 'application/json', Authorization: `Bearer ${scene.bench.address.searchParams.get('token')}`, 'Stickslip-Client': 'Ann' },
          body: JSON.stringify(body),
        })
        return response.json()
      }
      const answer = await call({ call: 'home' })
      if (answer.answer !== 'done') throw new Error(JSON.stringify(answer))
      while ((await call({ call: 'status' })).doing) await new Promise((later) => setTimeout(later, 100))
      await call({ call: 'move', reference: 'sine', values: { amplitude: 5, frequency: 0.5 } })
      for (let i = 0; i < pages; i += 1) {
        const page = await scene.page(`Viewer ${i}`, { width: 1440, height: 900 })
        await page.goto(scene.bench.address.href)
        await page.goto(new URL('/scope', scene.bench.address).href)
      }
      await new Promise((later) => setTimeout(later, 1000 * seconds))
      const { clock, cycle } = await call({ call: 'status' })
      const [p50, p99, p999] = clock.lateness
      console.log(`${String(pages).padStart(8)}${us(p50)} ${us(p99)} ${us(p999)}  ${clock.held} of ${cycle}, ${clock.lost}`)
    }, [], cpu)
