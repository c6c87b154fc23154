// Each window at 200 % zoom, on a phone, a tablet and in forced colours: nothing hidden, cut or covered, Stop in reach.

import assert from 'node:assert/strict'
import { join } from 'node:path'
import { caller, play } from './harness.mjs'

const WINDOWS = ['/', '/friction', '/design', '/controller', '/test', '/test?compare', '/simulation', '/runs', '/help', '/scope']
const SIZES = { zoomed: { width: 640, height: 360 }, phone: { width: 390, height: 844 }, tablet: { width: 820, height: 1180 } }

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
    if (style.overflowX !== 'visible' && style.overflowX !== 'auto' && one.scrollWidth > one.clientWidth + 1 && !one.closest('[title]')) faults.push(`cut: "${one.textContent.trim().slice(0, 40)}"`)
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

/** Cards over each other, covered controls, and a text of the guide that is too narrow to read. */
function coverFaults() {
  const faults = []
  const name = (one) => one.ariaLabel || one.getAttribute('aria-label') || one.textContent.trim().slice(0, 30) || one.tagName
  const cards = [...document.querySelectorAll('main .card')].filter((one) => one.checkVisibility())
  cards.forEach((a, n) => {
    for (const b of cards.slice(n + 1)) {
      if (a.contains(b) || b.contains(a)) continue
      const [p, q] = [a.getBoundingClientRect(), b.getBoundingClientRect()]
      if (p.left < q.right - 1 && q.left < p.right - 1 && p.top < q.bottom - 1 && q.top < p.bottom - 1) faults.push(`the cards "${name(a)}" and "${name(b)}" overlap`)
    }
  })
  for (const one of document.querySelectorAll('main :is(button, select, input), [role=alert] button, .dock button')) {
    if (!one.checkVisibility({ visibilityProperty: true, opacityProperty: true }) || one.closest('svg, .hidden, [data-scrolls]')) continue
    if (one.closest('.window')) one.scrollIntoView({ block: 'center', inline: 'center' })
    const box = one.getBoundingClientRect()
    // With the tool for points, a click anywhere in the plot sets a point.
    const at = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2)
    if (box.width && !(at && (one.contains(at) || at.contains(one) || at.closest('label')?.contains(one) || at.closest('.sheet')))) faults.push(`"${name(one)}" is covered${at ? ` by ${at.tagName}.${at.className}` : ''}`)
  }
  const article = document.querySelector('article')
  if (article && article.clientWidth < Math.min(440, 0.7 * innerWidth)) faults.push(`the guide is ${article.clientWidth} wide in ${innerWidth}`)
  return faults.slice(0, 8)
}

await play(async (scene) => {
  const ann = await scene.page('Ann')
  const call = caller(ann)
  await ann.goto(scene.bench.address.href)
  await ann.getByRole('main').waitFor()
  await call({ call: 'measure', what: 'friction', plan: { slowest: '4', fastest: '40', speeds: '3', settling_time: '0.1' } })
  do await ann.waitForTimeout(100)
  while ((await call({ call: 'status' })).doing)
  const all = []
  /** Loads a window on the smallest screen: a window that fits there may not fit another one after a change of size. */
  const open = async (path) => {
    await ann.setViewportSize(SIZES.phone)
    await ann.goto(scene.bench.address.origin + path)
    await ann.getByRole('main').waitFor()
  }
  /** In forced colours, selected, disabled and active controls are distinguishable. */
  const forcedColours = async (path) => {
    await ann.emulateMedia({ forcedColors: 'active' })
    await resize({ width: 1280, height: 800 })
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
    await ann.emulateMedia({ forcedColors: 'none' })
  }
  /** Changes the size, and waits until all plots have it. */
  const resize = async (size) => {
    await ann.setViewportSize(size)
    await ann.waitForTimeout(300)
  }
  for (const path of WINDOWS)
    await scene.step(`${path} in every size`, async () => {
      await open(path)
      for (const [name, size] of Object.entries(SIZES)) {
        await resize(size)
        all.push(...(await ann.evaluate(layoutFaults)).map((fault) => `${path}, ${name}: ${fault}`))
        all.push(...(await ann.evaluate(coverFaults)).map((fault) => `${path}, ${name}: ${fault}`))
        await scene.accessible(ann, `${path}, ${name}`)
        if (process.env.SHOTS) await ann.screenshot({ path: join(process.env.SHOTS, `${name}${path.replace('/', '-')}.png`) })
      }
      await forcedColours(path)
    })
  assert.deepEqual(all, [], 'nothing is cut or out of reach')
  await scene.step('dialogs and popups fit a phone', async () => {
    const command = async (name) => {
      await open('/')
      await ann.keyboard.press('Control+k')
      await ann.getByRole('dialog').waitFor()
      await ann.keyboard.type(name)
      await ann.keyboard.press('Enter')
      await ann.getByRole('dialog', { name }).waitFor()
    }
    const shown = {
      settings: () => command('Settings'),
      sets: () => command('Parameter sets'),
      keys: () => command('Keys'),
      library: () => open('/design').then(() => ann.getByRole('button', { name: 'Library' }).click()),
      trigger: () => open('/scope').then(() => ann.getByRole('button', { name: /^Trigger/ }).click()),
      download: async () => {
        await open('/controller')
        const gain = ann.getByRole('region', { name: 'Gains' }).getByRole('textbox', { name: /position gain/ })
        await gain.fill('12')
        await gain.press('Enter')
        await ann.getByRole('button', { name: /^Download 1 change/ }).click()
      },
    }
    for (const [what, show] of Object.entries(shown)) {
      await show()
      await ann.waitForTimeout(200)
      const outside = await ann.evaluate(() => {
        const one = document.querySelector('[role=dialog], .pop, [role=group][aria-label=Trigger]')
        const parts = [one, ...one.querySelectorAll('*')].filter((part) => part.checkVisibility() && !part.closest('option, svg *'))
        const box = one.getBoundingClientRect()
        return parts.filter((part) => {
          const { left, right, width } = part.getBoundingClientRect()
          return width && (left < Math.max(0, box.left) - 1 || right > Math.min(innerWidth, box.right) + 1)
        }).map((part) => `${part.tagName}.${part.className} "${part.textContent.trim().slice(0, 30)}"`)
      })
      if (process.env.SHOTS) await ann.screenshot({ path: join(process.env.SHOTS, `phone-${what}.png`) })
      assert.deepEqual(outside, [], `${what}: outside`)
    }
  })
  await scene.step('the banner of a fault keeps its buttons in reach', async () => {
    await call({ call: 'move', reference: 'sine', values: { amplitude: 1, frequency: 1 } })
    await call({ call: 'inject', fault: 'encoder-stuck' })
    await ann.getByRole('alert', { name: 'Fault' }).waitFor()
    for (const path of ['/', '/design', '/scope']) {
      await open(path)
      await ann.getByRole('alert', { name: 'Fault' }).waitFor()
      for (const [name, size] of Object.entries(SIZES)) {
        await resize(size)
        all.push(...[...(await ann.evaluate(layoutFaults)), ...(await ann.evaluate(coverFaults))].map((fault) => `${path}, ${name}, fault: ${fault}`))
        if (process.env.SHOTS) await ann.screenshot({ path: join(process.env.SHOTS, `fault-${name}${path.replace('/', '-')}.png`) })
      }
    }
    assert.deepEqual(all, [])
  })
})
