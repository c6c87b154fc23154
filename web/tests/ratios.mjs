// Drawn text keeps its size at device pixel ratios 1, 1.5 and 2, at 200 % zoom, on a phone and after a change of screen.

import assert from 'node:assert/strict'
import { join } from 'node:path'
import { play } from './harness.mjs'

/** Limits of the text size in a plot [px of the page]. */
const [LEAST, MOST] = [10.9, 14]
const SCREENS = {
  'ratio 1': {},
  'ratio 1.5': { deviceScaleFactor: 1.5 },
  'ratio 2': { deviceScaleFactor: 2 },
  'zoom 200 %': { deviceScaleFactor: 2, width: 720, height: 450 },
  phone: { deviceScaleFactor: 3, width: 390, height: 844, isMobile: true, hasTouch: true },
}
const PATHS = ['/friction', '/design', '/controller', '/runs', '/scope']

/** Notes the texts that are drawn on each canvas, with their size in pixels of the canvas. */
function note() {
  const drawn = (window.drawn = new Map())
  const { fillText } = CanvasRenderingContext2D.prototype
  CanvasRenderingContext2D.prototype.fillText = function (text, ...rest) {
    const { a, b } = this.getTransform()
    const size = Number(/([\d.]+)px/.exec(this.font)[1]) * Math.hypot(a, b)
    if (!drawn.has(this.canvas)) drawn.set(this.canvas, new Map())
    drawn.get(this.canvas).set(text, size)
    return fillText.call(this, text, ...rest)
  }
}

/** The sizes of all texts in canvases and drawings [px of the page]. */
function sizes() {
  const texts = []
  for (const [canvas, drawn] of window.drawn) {
    const { width } = canvas.getBoundingClientRect()
    if (canvas.isConnected && width) for (const [text, size] of drawn) texts.push({ text, size: (size * width) / canvas.width })
  }
  for (const text of document.querySelectorAll('main svg text')) {
    const size = parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a
    if (text.checkVisibility()) texts.push({ text: text.textContent.trim(), size, drawing: true })
  }
  return texts
}

await play(async (scene) => {
  const ann = await scene.page('Ann')
  await ann.goto(scene.bench.address.href)
  await ann.evaluate(async () => {
    const call = async (body) => (await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': 'Ann' }, body: JSON.stringify(body) })).json()
    await call({ call: 'measure', what: 'friction', plan: { slowest: '2', fastest: '40', speeds: '5' } })
    do await new Promise((resolve) => setTimeout(resolve, 200))
    while ((await call({ call: 'status' })).doing)
  })
  await ann.context().close()

  const check = async (page, where, path) => {
    const texts = await page.evaluate(sizes)
    const plots = texts.filter((one) => !one.drawing)
    assert.ok(path === '/runs' || plots.length >= 8, `${where}: only ${plots.length} texts in plots`)
    const wrong = plots.filter(({ size }) => size < LEAST || size > MOST)
    assert.deepEqual(wrong.map(({ text, size }) => `"${text}" ${size.toFixed(1)} px`), [], where)
    return plots.length
  }
  for (const [name, screen] of Object.entries(SCREENS))
    await scene.step(`texts of all plots, ${name}`, async () => {
      const page = await scene.page('Ann', screen)
      await page.addInitScript(note)
      await page.goto(scene.bench.address.href)
      for (const path of PATHS) {
        await page.goto(scene.bench.address.origin + path)
        await page.getByRole('main').waitFor()
        if (path !== '/runs') await page.waitForFunction(() => [...window.drawn.values()].some((texts) => texts.size > 6))
        await page.waitForTimeout(300)
        await check(page, `${path}, ${name}`, path)
        if (process.env.SHOTS) await page.screenshot({ path: join(process.env.SHOTS, `${name.replace(/\W+/g, '-')}${path.replace('/', '-')}.png`) })
      }
      await page.context().close()
    })
  await scene.step('texts after the window has moved to a screen with another ratio', async () => {
    const page = await scene.page('Ann')
    await page.addInitScript(note)
    await page.goto(scene.bench.address.href)
    await page.goto(`${scene.bench.address.origin}/friction`)
    await page.waitForFunction(() => [...window.drawn.values()].some((texts) => texts.size > 6))
    const session = await page.context().newCDPSession(page)
    for (const deviceScaleFactor of [2, 1.5, 1]) {
      await page.evaluate(() => window.drawn.clear())
      await session.send('Emulation.setDeviceMetricsOverride', { width: 1440, height: 900, deviceScaleFactor, mobile: false })
      await page.waitForFunction(() => [...window.drawn.values()].some((texts) => texts.size > 6))
      await check(page, `ratio ${deviceScaleFactor}`, '/friction')
    }
  })
})
