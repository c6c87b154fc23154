// Drawn text keeps its size at device pixel ratios 1, 1.5 and 2, at 200 % zoom, on a phone and after a change of screen, and
// no text of a plot covers another one.

import assert from 'node:assert/strict'
import { join } from 'node:path'
import { play } from './harness.mjs'

/** Limits of the text size in a plot [px of the page]. */
const [LEAST, MOST] = [10.9, 14]
/** The least text size in a drawing, which has indices [px of the page]. */
const LEAST_DRAWN = 8.9
/** Windows without plots while the scope is collapsed. */
const WITHOUT = ['/', '/runs']
/** Screens to which an open window moves, or by which its ratio changes. */
const SCREENS = {
  'ratio 1': { width: 1440, height: 900, deviceScaleFactor: 1 },
  'ratio 1.5': { width: 1440, height: 900, deviceScaleFactor: 1.5 },
  'ratio 2': { width: 1440, height: 900, deviceScaleFactor: 2 },
  'zoom 200 %': { width: 720, height: 450, deviceScaleFactor: 2 },
}
/** Screens on which each window is opened. */
const OPENED = {
  'opened at ratio 1.5': { deviceScaleFactor: 1.5 },
  phone: { deviceScaleFactor: 3, width: 390, height: 844, isMobile: true, hasTouch: true },
}
const PATHS = ['/', '/friction', '/design', '/controller', '/test', '/simulation', '/runs', '/scope']

/** Notes the texts that are drawn on each canvas, with size and box in pixels of the canvas. */
function note() {
  const drawn = (window.drawn = new Map())
  const { fillText, clearRect } = CanvasRenderingContext2D.prototype
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    drawn.delete(this.canvas)
    return clearRect.apply(this, box)
  }
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...rest) {
    const transform = this.getTransform()
    const size = Number(/([\d.]+)px/.exec(this.font)[1])
    const { actualBoundingBoxLeft: left, actualBoundingBoxRight: right, actualBoundingBoxAscent: up, actualBoundingBoxDescent: down } = this.measureText(text)
    const corners = [[x - left, y - up], [x + right, y + down]].map(([x, y]) => transform.transformPoint({ x, y }))
    const [xs, ys] = [corners.map((corner) => corner.x), corners.map((corner) => corner.y)]
    const box = { left: Math.min(...xs), right: Math.max(...xs), top: Math.min(...ys), bottom: Math.max(...ys) }
    if (!drawn.has(this.canvas)) drawn.set(this.canvas, new Map())
    if (text) drawn.get(this.canvas).set(`${text} at ${Math.round(box.left)}, ${Math.round(box.top)}`, { text, size: size * Math.hypot(transform.a, transform.b), box })
    return fillText.call(this, text, x, y, ...rest)
  }
}

/** Pairs of texts that overlap on a canvas. */
function overlaps() {
  const pairs = []
  for (const [canvas, drawn] of window.drawn) {
    const texts = canvas.isConnected ? [...drawn.values()] : []
    texts.forEach((a, n) => {
      for (const b of texts.slice(n + 1))
        if (a.box.left < b.box.right && b.box.left < a.box.right && a.box.top < b.box.bottom && b.box.top < a.box.bottom) pairs.push(`"${a.text}" and "${b.text}"`)
    })
  }
  return pairs
}

/** Texts that are cut by the edge of their canvas. */
function cutTexts() {
  return [...window.drawn].flatMap(([canvas, drawn]) => {
    const outside = ({ box }) => box.left < -1 || box.top < -1 || box.right > canvas.width + 1 || box.bottom > canvas.height + 1
    return canvas.isConnected ? [...drawn.values()].filter(outside).map(({ text }) => `"${text}"`) : []
  })
}

/** The sizes of all texts in canvases and drawings [px of the page]. */
function sizes() {
  const texts = []
  for (const [canvas, drawn] of window.drawn) {
    const { width } = canvas.getBoundingClientRect()
    if (canvas.isConnected && width) for (const { text, size } of drawn.values()) texts.push({ text, size: (size * width) / canvas.width })
  }
  for (const text of document.querySelectorAll('main svg text')) {
    const size = parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a
    if (text.checkVisibility()) texts.push({ text: text.textContent.trim(), size, drawing: true })
  }
  return texts
}

/** Words that are cut off, and labels whose rim covers their own letters. */
function cutWords() {
  const ends = (one) => getComputedStyle(one).textOverflow === 'ellipsis' && one.scrollWidth > one.clientWidth + 1
  // A row of a list or of the scope's signals may be shortened: it has a tooltip.
  const cut = [...document.querySelectorAll('main *')].filter((one) => one.checkVisibility() && ends(one) && !one.closest('li, tr'))
  const covered = [...document.querySelectorAll('main svg text')].filter((one) => {
    const { stroke, fill } = getComputedStyle(one)
    return stroke !== 'none' && fill !== 'none' && one.querySelector('tspan')
  })
  return [...cut, ...covered].map((one) => `"${one.textContent.trim()}"`)
}

await play(async (scene) => {
  const ann = await scene.page('Ann')
  await ann.goto(scene.bench.address.href)
  await ann.getByRole('main').waitFor()
  await ann.evaluate(async () => {
    const call = async (body) => (await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': 'Ann' }, body: JSON.stringify(body) })).json()
    await call({ call: 'measure', what: 'friction', plan: { slowest: '4', fastest: '40', speeds: '5', settling_time: '0.1' } })
    do await new Promise((resolve) => setTimeout(resolve, 100))
    while ((await call({ call: 'status' })).doing)
    await call({ call: 'trial', motion: 'sine_2hz', repetitions: 1 })
    do await new Promise((resolve) => setTimeout(resolve, 100))
    while ((await call({ call: 'status' })).doing)
  })
  await ann.context().close()

  const check = async (page, where, path) => {
    const texts = await page.evaluate(sizes)
    const plots = texts.filter((one) => !one.drawing)
    assert.ok(WITHOUT.includes(path) || plots.length >= 8, `${where}: only ${plots.length} texts in plots`)
    const wrong = [...plots.filter(({ size }) => size < LEAST || size > MOST), ...texts.filter(({ drawing, size }) => drawing && size < LEAST_DRAWN)]
    assert.deepEqual(wrong.map(({ text, size }) => `"${text}" ${size.toFixed(1)} px`), [], where)
    assert.deepEqual(await page.evaluate(overlaps), [], `${where}: texts cover each other`)
    assert.deepEqual(await page.evaluate(cutTexts), [], `${where}: texts cut by the edge of the plot`)
    if (where.endsWith('ratio 2')) assert.deepEqual(await page.evaluate(cutWords), [], `${where}: cut words`)
  }
  const drawn = (page, path) => WITHOUT.includes(path) || page.waitForFunction(() => [...window.drawn.values()].some((texts) => texts.size > 6))
  const picture = (page, name, path) => process.env.SHOTS && page.screenshot({ path: join(process.env.SHOTS, `${name.replace(/\W+/g, '-')}${path.replace('/', '-')}.png`) })
  const open = async (page, path) => {
    await page.goto(scene.bench.address.origin + path)
    await page.getByRole('main').waitFor()
    await drawn(page, path)
  }
  const first = async (screen) => {
    const page = await scene.page('Ann', screen)
    await page.addInitScript(note)
    await page.goto(scene.bench.address.href)
    return page
  }
  for (const [name, screen] of Object.entries(OPENED))
    await scene.step(`texts of all plots, ${name}`, async () => {
      const page = await first(screen)
      for (const path of PATHS) {
        await open(page, path)
        await page.waitForTimeout(300)
        await check(page, `${path}, ${name}`, path)
        await picture(page, name, path)
      }
      await page.context().close()
    })
  await scene.step('texts of all plots of a window that moves to screens with other ratios', async () => {
    const page = await first()
    const session = await page.context().newCDPSession(page)
    for (const path of PATHS) {
      await open(page, path)
      for (const [name, screen] of Object.entries(SCREENS)) {
        await page.evaluate(() => window.drawn.clear())
        await session.send('Emulation.setDeviceMetricsOverride', { ...screen, mobile: false })
        await drawn(page, path)
        await page.waitForTimeout(200)
        await check(page, `${path}, ${name}`, path)
        await picture(page, name, path)
      }
    }
  })
})
