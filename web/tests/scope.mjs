// The scope: every cycle is available as sent by the program; hold, cursors, trigger, export.

import assert from 'node:assert/strict'
import { readFileSync } from 'node:fs'
import { play, state } from './harness.mjs'

await play(async (scene) => {
  const ann = await scene.page('Ann')
  const dock = ann.getByRole('region', { name: 'Scope', exact: true })
  const pane = (name) => dock.getByRole('region', { name })
  const button = (name) => dock.getByRole('button', { name, exact: true })
  const call = (body) =>
    ann.evaluate(async (body) => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': 'Ann' }, body: JSON.stringify(body) })
      return response.json()
    }, body)
  const until = async (done) => {
    for (;;) {
      const answer = await done()
      if (answer) return answer
      await ann.waitForTimeout(50)
    }
  }
  /** Restarts the motion if a busy computer has ended it. */
  const moving = async () => {
    if ((await call({ call: 'status' })).doing) return
    await call({ call: 'move', reference: 'sine', values: { amplitude: 2, frequency: 1 } })
  }
  /** Moves the pointer to a position in the plot of a pane. */
  const point = async (name, x = 0.5, y = 0.5) => {
    const { left, top, width, height } = await pane(name).locator('.area').evaluate((area) => area.getBoundingClientRect().toJSON())
    await ann.mouse.move(left + x * width, top + y * height)
  }
  const leave = async (kind) => {
    await button('Export from the scope').click()
    const [download] = await Promise.all([ann.waitForEvent('download'), dock.getByRole('button', { name: kind, exact: true }).click()])
    return readFileSync(await download.path())
  }

  await scene.step('panes with signals appear below the window at once', async () => {
    await ann.goto(scene.bench.address.href)
    await ann.keyboard.press('s')
    await pane('Pane: angle, setpoint position over time').waitFor()
    await ann.getByRole('main').getByRole('button', { name: 'Home axis' }).first().click()
    await ann.getByText('Homed', { exact: true }).waitFor()
    await moving()
    await dock.getByRole('button', { name: /^state/ }).getByText('running').waitFor()
    await ann.waitForTimeout(1500)
    await scene.snapshot(ann, 'scope-dock')
  })
  await scene.step('each sample equals that of the program, cycle by cycle', async () => {
    const signals = ['setpoint.position', 'software.estimated_velocity']
    const { capture } = await call({ call: 'capture', signals, trigger: 'immediate', before: 0, after: 0.5 })
    const captured = await until(async () => {
      const answer = await call({ call: 'fetch', capture })
      return answer.answer === 'captured' ? answer : null
    })
    await ann.waitForTimeout(200)
    const [head, ...lines] = (await leave('CSV of all data')).toString().trim().split('\n')
    const columns = head.split(',')
    assert.deepEqual(columns.slice(0, 4), ['cycle [1]', 'time [s]', 'angle [rad]', 'setpoint.position [rad]'])
    const rows = new Map(lines.map((line) => line.split(',').map(Number)).map((row) => [row[0], row]))
    const cycles = [...rows.keys()]
    const shown = /, ([\d\u202f]+) missing/.exec(await dock.locator('header').first().innerText())
    const missing = shown ? Number(shown[1].replace(/\D/g, '')) : 0
    assert.ok(cycles.every((cycle, i) => i === 0 || cycle > cycles[i - 1]))
    // Missing cycles before the first row are counted, too; more may have been lost since.
    assert.ok(cycles.at(-1) - cycles[0] + 1 - cycles.length <= missing, `${cycles.length} rows, ${missing} missing`)
    captured.cycles.forEach((cycle, i) => {
      const row = rows.get(cycle)
      assert.ok(row, `cycle ${cycle}`)
      signals.forEach((signal, k) => assert.equal(row[columns.indexOf(`${signal} [${k ? 'rad/s' : 'rad'}]`)], captured.columns[k][i]))
    })
  })
  await scene.step('cursors by keyboard and mouse, and statistics between them', async () => {
    // Both where the page has samples, however short ago it was opened.
    await point(/estimated velocity/, 0.75)
    await ann.keyboard.press(' ')
    await button('Resume Space').waitFor()
    await ann.keyboard.press('a')
    await point(/estimated velocity/, 0.9)
    await ann.keyboard.press('b')
    await dock.getByRole('button', { name: 'Cursors' }).first().click()
    const a = dock.getByRole('slider', { name: 'Cursor A' })
    const time = async () => {
      const [number, unit] = (await a.getAttribute('aria-valuetext')).split(/\s/)
      return Number(number) * (unit === 'ms' ? 1e-3 : 1)
    }
    const before = await time()
    await a.press('Shift+ArrowRight')
    assert.ok(Math.abs((await time()) - before - 0.001) < 1e-4, 'a sample')
    await a.press('PageUp')
    assert.ok((await time()) > before + 0.01)
    const row = dock.getByRole('row', { name: /setpoint velocity/ })
    const numbers = (await row.getByRole('cell').allInnerTexts()).map((text) => Number(text.replace('\u2212', '-').replace(/\s/g, '')))
    const [mean, rms, least, largest] = numbers
    assert.ok(least <= mean && mean <= largest && rms <= Math.max(-least, largest) && rms > 0, String(numbers))
    await scene.snapshot(ann, 'scope-cursors')
    const lines = (await leave('CSV between the cursors')).toString().trim().split('\n')
    const apart = (await dock.locator('dl').innerText()).match(/Δ\s+([\d.]+)\s(m?s)/)
    const seconds = Number(apart[1]) * (apart[2] === 'ms' ? 1e-3 : 1)
    assert.ok(Math.abs((lines.length - 2) / 1000 - seconds) < 2e-3 * (1 + seconds), `${lines.length} ${apart}`)
    await a.press('Delete')
    assert.equal(await a.count(), 0)
  })
  await scene.step('a box zooms; previous and next views; 0 shows all data', async () => {
    const text = async () => (await dock.locator('header').first().innerText()).match(/([\d.]+ m?s) of/)[1]
    const before = await text()
    await point(/estimated velocity/, 0.5, 0.5)
    await ann.mouse.down()
    await point(/estimated velocity/, 0.6, 0.52)
    await ann.mouse.up()
    await until(async () => (await text()) !== before)
    const zoomed = await text()
    await ann.keyboard.press('[')
    await until(async () => (await text()) === before)
    await ann.keyboard.press(']')
    await until(async () => (await text()) === zoomed)
    await ann.keyboard.press('0')
    await until(async () => (await text()) !== zoomed)
    const part = dock.getByRole('slider', { name: 'Visible range' })
    await part.press('ArrowUp')
    await part.press('PageDown')
    assert.match(await part.getAttribute('aria-valuetext'), /up to/)
  })
  await scene.step('a single event holds the display; the level can be moved', async () => {
    await dock.getByRole('button', { name: /^Trigger:/ }).click()
    await dock.getByRole('combobox', { name: 'Signal' }).selectOption('setpoint.velocity')
    await dock.getByLabel('Level').fill('3')
    await dock.getByLabel('Level').press('Tab')
    await scene.accessible(ann, 'trigger')
    await button('Single').click()
    await dock.getByRole('button', { name: /^Trigger:/ }).click()
    await point(/estimated velocity/, 0.5, 0.5)
    for (let i = 0; i < 6; i++) await ann.mouse.wheel(0, -200)
    await until(async () => (await moving(), await button('Resume Space').isVisible()))
    const level = dock.getByRole('slider', { name: 'Trigger level' })
    await level.press('ArrowUp')
    assert.ok(Number(await level.getAttribute('aria-valuenow')) > 3)
    // The sample at the event has passed the level, the previous one has not.
    await ann.keyboard.press('0')
    await scene.snapshot(ann, 'scope-trigger')
    await dock.getByRole('button', { name: /^Trigger:/ }).click()
    await button('Off').click()
    await dock.getByRole('button', { name: /^Trigger:/ }).click()
  })
  await scene.step('a channel is computed from signals, and the sine has its frequency in the spectrum', async () => {
    // The tab next to the panes; the button with the same name closes them.
    await dock.getByRole('button', { name: 'Signals', exact: true }).last().click()
    await button('Computed channel').click()
    const formula = dock.getByLabel('Formula')
    await formula.fill('speed + 1')
    await formula.press('Enter')
    await dock.getByRole('alert').getByText('unknown signal speed').waitFor()
    await formula.fill('slope = d()')
    await formula.press('ArrowLeft')
    await button('Insert setpoint position').click()
    assert.equal(await formula.inputValue(), 'slope = d(setpoint.position)')
    await scene.accessible(ann, 'formula')
    await button('New spectrum pane').click()
    await dock.getByLabel('Unit of the channel').fill('rad/s')
    await button('Add').click()
    await pane('Pane: slope over frequency').waitFor()
    await button('Computed channel').click()
    await ann.keyboard.press('0')
    // A sine of 2 rad at 1 Hz has a speed of 4 pi rad/s; a motion that a busy computer has ended is restarted.
    const area = pane('Pane: slope over frequency').locator('.area')
    await until(async () => {
      await moving()
      await area.hover()
      const match = / ([\d.]+) rad\/s at ([\d.]+) Hz/.exec(await area.locator('.tip').innerText().catch(() => ''))
      return match && Math.abs(Number(match[2]) - 1) < 0.05 && Number(match[1]) > 5
    })
    const lines = (await leave('CSV of the visible range')).toString().trim().split('\n')
    const columns = lines[0].split(',')
    const [position, slope] = ['setpoint.position [rad]', 'slope [rad/s]'].map((name) => columns.indexOf(name))
    const [one, two] = lines.slice(-2).map((line) => line.split(',').map(Number))
    if (two[0] === one[0] + 1) assert.ok(Math.abs(two[slope] - (two[position] - one[position]) * 1000) < 1e-9)
    await area.scrollIntoViewIfNeeded()
    await scene.snapshot(ann, 'scope-spectrum')
    assert.match((await leave('SVG of the scope')).toString(), /amplitude, rad\/s/)
    const spectrum = pane('Pane: slope over frequency')
    await spectrum.getByText(/newest [\d.]+ s, live/).waitFor()
    await ann.keyboard.press('Space')
    await spectrum.getByText(/[\d.]+ s of the visible range, [2-9]\s*s old/).waitFor()
    await point(/estimated velocity/, 0.3, 0.5)
    await ann.keyboard.press('a')
    await point(/estimated velocity/, 0.8, 0.5)
    await ann.keyboard.press('b')
    await spectrum.getByText(/[\d.]+ s between the cursors, \d+\s*s old/).waitFor()
    const held = (await leave('SVG of the scope')).toString()
    assert.match(held, /Cursor A/)
    assert.match(held, /Cursor B/)
    await ann.keyboard.press('Control+k')
    await ann.keyboard.type('remove cursors')
    await ann.keyboard.press('Enter')
    await point(/estimated velocity/, 0.5, 0.5)
    await ann.keyboard.press('Space')
    await spectrum.getByText(/newest [\d.]+ s, live/).waitFor()
    await pane(/over frequency/).getByRole('button', { name: 'Remove pane' }).click({ force: true })
    await button('Delete slope').click()
    assert.equal(await button('Delete slope').count(), 0)
  })
  await scene.step('a parameter change triggers, too', async () => {
    // A view is displayed when it is complete; a long view takes long.
    await point(/estimated velocity/, 0.5, 0.5)
    for (let i = 0; i < 10; i++) await ann.mouse.wheel(0, -200)
    await dock.getByRole('button', { name: /^Trigger:/ }).click()
    await dock.getByRole('combobox', { name: 'Event' }).selectOption('change')
    await button('Single').click()
    await call({ call: 'set', values: { 'bench.controller.position_gain': '12' } })
    await button('Resume Space').waitFor()
    await button('Off').click()
    await dock.getByRole('combobox', { name: 'Event' }).selectOption('rising')
    await dock.getByRole('button', { name: /^Trigger:/ }).click()
  })
  await scene.step('a signal is found and added; a pane is added and removed', async () => {
    const find = dock.getByLabel('Find a signal')
    await button('New pane').click()
    await find.fill('tacho')
    await find.press('Enter')
    await pane(/measurement tacho voltage/).waitFor()
    await dock.getByRole('button', { name: /^state/ }).dragTo(pane(/measurement tacho voltage/).locator('.area'))
    await pane('Pane: measurement tacho voltage, state over time').waitFor()
    await ann.setViewportSize({ width: 1440, height: 900 })
    await ann.reload()
    await pane('Pane: measurement tacho voltage, state over time').waitFor()
    await pane(/tacho/).getByRole('button', { name: 'Remove pane' }).click({ force: true })
    assert.equal(await pane(/tacho/).count(), 0)
  })
  await scene.step('figures are exported in light style, a recording becomes a run, S opens and closes', async () => {
    await ann.waitForTimeout(500)
    const svg = (await leave('SVG of the scope')).toString()
    assert.match(svg, /#0b7a9f/i)
    assert.match(svg, /N·m/)
    assert.ok((await leave('PNG of the scope')).length > 5000)
    await button('Record').click()
    await dock.getByRole('button', { name: /^Recording/ }).waitFor()
    // The recording is shown in every window, also on a phone.
    const recording = ann.getByRole('banner').getByRole('button', { name: /^\d+ s\s*recording/ })
    for (const path of ['/', '/friction', '/help', '/scope']) {
      await ann.goto(scene.bench.address.origin + path)
      await recording.waitFor()
      await ann.setViewportSize({ width: 390, height: 844 })
      await ann.getByRole('banner').getByRole('button', { name: /^\d+ s/ }).waitFor()
      if (path === '/' && process.env.SHOTS) await ann.screenshot({ path: `${process.env.SHOTS}/recording-phone.png` })
      await ann.setViewportSize({ width: 1440, height: 900 })
    }
    await ann.goto(scene.bench.address.origin)
    await scene.snapshot(ann, 'recording')
    await recording.click()
    await recording.waitFor({ state: 'detached' })
    await button('Record').waitFor()
    // The run is listed when its file has been written.
    while (!(await call({ call: 'runs', query: 'kind:recording' })).of) await ann.waitForTimeout(50)
    await ann.keyboard.press('2')
    await ann.keyboard.press('s')
    await pane(/estimated velocity/).waitFor()
    await ann.keyboard.press('s')
    await dock.getByText(/estimated velocity/).waitFor()
    assert.equal(await pane(/estimated velocity/).count(), 0)
  })
  await scene.step('a separate window marks a parameter change and a fault', async () => {
    await ann.goto(`${scene.bench.address.origin}/scope`)
    await dock.getByRole('button', { name: /^state/ }).getByText('running').waitFor()
    await call({ call: 'set', values: { 'bench.controller.position_gain': '11' } })
    await dock.locator('.mark.change').first().waitFor({ state: 'attached' })
    // At rest a stuck encoder is not detected.
    await moving()
    await call({ call: 'inject', fault: 'encoder-stuck' })
    await dock.locator('.mark.fault').waitFor({ state: 'attached' })
    await scene.snapshot(ann, 'scope-window')
  })
  await scene.step('after a restart of the program the scope reconnects with the same panes', async () => {
    await scene.unreachable(async () => {
      await scene.bench.stop()
      await dock.getByText('not connected').waitFor()
      await scene.serve(scene.bench.address.host)
      await state(ann).getByText('Off', { exact: true }).waitFor()
      await dock.getByRole('button', { name: /^state/ }).getByText('off').waitFor()
      await pane(/estimated velocity/).waitFor()
    })
  })
})
