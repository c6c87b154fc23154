// Times of a drag in Friction Design: `node tests/drag-rate.mjs [moves] [interval in ms]`. Prints the time from a movement of
// the pointer to the changed curve and to the frame that shows it, and the time between frames meanwhile. STICKSLIP
// should be a release build.

import { play } from './harness.mjs'

const [moves, interval] = [300, 33].map((usual, i) => Number(process.argv[2 + i] ?? usual))

const quantiles = (times) => {
  const sorted = times.toSorted((a, b) => a - b)
  const at = (share) => `${sorted[Math.floor(share * (sorted.length - 1))].toFixed(1)} ms`
  return `median ${at(0.5)}, p95 ${at(0.95)}, largest ${at(1)} (${sorted.length})`
}

await play(async (scene) => {
  const page = await scene.page('Ann', { width: 1440, height: 900 })
  await page.goto(scene.bench.address.href)
  await page.keyboard.press('3')
  const grip = page.getByRole('slider', { name: 'Breakaway torque', exact: true })
  await grip.waitFor()
  const { x, y, width, height } = await grip.boundingBox()
  const [left, top] = [x + width / 2, y + height / 2]
  await page.mouse.move(left, top)
  await page.mouse.down()
  await page.mouse.move(left, top - 20)
  await page.waitForTimeout(500)
  await grip.evaluate((grip) => {
    const times = { changed: [], shown: [], frames: [] }
    let moved = 0
    addEventListener('pointermove', () => (moved = performance.now()), { capture: true })
    new MutationObserver(() => {
      if (!moved) return
      const start = moved
      moved = 0
      times.changed.push(performance.now() - start)
      requestAnimationFrame(() => setTimeout(() => times.shown.push(performance.now() - start)))
    }).observe(grip, { attributeFilter: ['aria-valuenow'] })
    let before = 0
    const frame = (now) => {
      if (before) times.frames.push(now - before)
      before = now
      requestAnimationFrame(frame)
    }
    requestAnimationFrame(frame)
    window.times = times
  })
  for (let move = 0; move < moves; move += 1) {
    const next = page.waitForTimeout(interval)
    await page.mouse.move(left, top - 20 - 30 * Math.sin(move / 8))
    await next
  }
  const { changed, shown, frames } = await page.evaluate(() => window.times)
  await page.mouse.up()
  console.log(`pointer to changed curve: ${quantiles(changed)}`)
  console.log(`pointer to frame:         ${quantiles(shown)}`)
  console.log(`between frames:           ${quantiles(frames)}`)
})
