// Each window at 200 % zoom, on a phone and in forced colours: nothing hidden or cut, Stop in reach.

import assert from 'node:assert/strict'
import { join } from 'node:path'
import { play } from './harness.mjs'

const WINDOWS = ['/', '/friction', '/design', '/controller', '/simulation', '/runs', '/help']
const SIZES = { zoomed: { width: 640, height: 360 }, phone: { width: 390, height: 844 } }

/** Layout faults: horizontal scrolling, cut text, Stop out of sight or covered. */
function layoutFaults() {
  const faults = []
  const root = document.documentElement
  if (root.scrollWidth > root.clientWidth) faults.push(`the page is ${root.scrollWidth} wide in ${root.clientWidth}`)
  const window_ = document.querySelector('.window')
  if (window_.scrollWidth > window_.clientWidth + 1) {
    const wide = [...window_.querySelectorAll('*')].filter((one) => one.getBoundingClientRect().right > root.clientWidth + 1 && !one.closest('[data-scrolls]')).slice(0, 4)
    faults.push(`the window is ${window_.scrollWidth} wide in ${window_.clientWidth}: ${wide.map((one) => `${one.tagName}.${one.className}`).join(' ')}`)
  }
  const stop = [...document.querySelectorAll('header button')].find((one) => /Stop/.test(one.textContent))
  const box = stop.getBoundingClientRect()
  if (box.left < 0 || box.top < 0 || box.right > innerWidth || box.bottom > innerHeight) faults.push(`Stop is at ${Math.round(box.left)} to ${Math.round(box.right)}`)
  else if (!stop.contains(document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2))) faults.push('Stop is covered')
  for (const one of document.querySelectorAll('body *')) {
    const own = [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim())
    if (!own || one.closest('.hidden, svg, [aria-hidden=true]') || !one.checkVisibility()) continue
    const style = getComputedStyle(one)
    // Only for screen readers.
    if (style.clipPath !== 'none') continue
    if (style.overflowX !== 'visible' && style.overflowX !== 'auto' && one.scrollWidth > one.clientWidth + 1 && !one.title) faults.push(`cut: "${one.textContent.trim().slice(0, 40)}"`)
    // Text with a tooltip may be shortened.
    if (one.closest('[title]') && style.textOverflow === 'ellipsis') continue
    const range = document.createRange()
    range.selectNodeContents(one)
    const { left, right, width } = range.getBoundingClientRect()
    // Text in a scrollable element may be wider.
    let scroller = one.parentElement
    while (scroller && !/auto|scroll/.test(getComputedStyle(scroller).overflowX)) scroller = scroller.parentElement
    const scrolls = scroller && scroller !== window_ && scroller.scrollWidth > scroller.clientWidth
    if (width && !scrolls && (right > innerWidth + 1 || left < -1)) faults.push(`out of sight: "${one.textContent.trim().slice(0, 40)}"`)
  }
  return [...new Set(faults)].slice(0, 8)
}

await play(async (scene) => {
  const ann = await scene.page('Ann')
  await ann.goto(scene.bench.address.href)
  const all = []
  for (const [name, size] of Object.entries(SIZES))
    await scene.step(`every window, ${name}`, async () => {
      await ann.setViewportSize(size)
      for (const path of WINDOWS) {
        await ann.goto(scene.bench.address.origin + path)
        await ann.getByRole('main').waitFor()
        await ann.waitForTimeout(400)
        all.push(...(await ann.evaluate(layoutFaults)).map((fault) => `${path}, ${name}: ${fault}`))
        await scene.accessible(ann, `${path}, ${name}`)
        if (process.env.SHOTS) await ann.screenshot({ path: join(process.env.SHOTS, `${name}${path.replace('/', '-')}.png`) })
      }
    })
  assert.deepEqual(all, [], 'nothing is cut or out of reach')
  await scene.step('every window in forced colours: selected, disabled and active controls are distinguishable', async () => {
    await ann.setViewportSize({ width: 1280, height: 800 })
    await ann.emulateMedia({ forcedColors: 'active' })
    for (const path of WINDOWS) {
      await ann.goto(scene.bench.address.origin + path)
      await ann.getByRole('main').waitFor()
      await ann.waitForTimeout(400)
      await scene.accessible(ann, `${path}, forced colours`)
      // A background alone is not visible there: a pressed button has an edge or a system colour.
      const same = await ann.evaluate(() => {
        const look = (one) => ((style) => [style.backgroundColor, style.color, style.outlineStyle, style.borderTopColor, style.borderTopStyle, style.borderTopWidth].join())(getComputedStyle(one))
        return [...document.querySelectorAll('.segments')].filter((group) => {
          const [on, off] = [true, false].map((on) => group.querySelector(`[aria-pressed=${on}]`))
          return on && off && look(on) === look(off)
        }).map((group) => group.ariaLabel)
      })
      assert.deepEqual(same, [], `${path}: selected and unselected look the same`)
      if (process.env.SHOTS) await ann.screenshot({ path: join(process.env.SHOTS, `forced${path.replace('/', '-')}.png`) })
    }
    await ann.emulateMedia({ forcedColors: 'none' })
  })
})
