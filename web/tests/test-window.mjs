// The window Test: jog with all ways to let go, go to a position, manoeuvres, A and B, comparison of controllers.

import assert from 'node:assert/strict'
import { readFileSync, readdirSync, writeFileSync } from 'node:fs'
import { join } from 'node:path'
import { caller, play, state } from './harness.mjs'

await play(async (scene) => {
  const ann = await scene.page('Ann')
  ann.setDefaultTimeout(30_000)
  const call = caller(ann)
  const status = () => call({ call: 'status' })
  const button = (name) => ann.getByRole('main').getByRole('button', { name })
  const forward = button('Jog forward')
  const trials = ann.getByRole('region', { name: 'Trials' })
  const rows = trials.locator('tbody tr')

  /** Waits until the axis rests; returns its angle. */
  async function rest(within = 1500) {
    const start = Date.now()
    for (;;) {
      const { doing, velocity, angle } = await status()
      if (!doing && Math.abs(velocity) < 0.5) return angle
      assert.ok(Date.now() - start < within, `${doing?.what} with ${velocity} rad/s after ${within} ms`)
      await ann.waitForTimeout(30)
    }
  }
  const center = async (locator) => {
    const { x, y, width, height } = await locator.boundingBox()
    return [x + width / 2, y + height / 2]
  }
  /** Presses and holds the button; checks that the axis moves. A pause of a busy machine ends a jog: another attempt. */
  async function hold(time = 500) {
    for (let attempt = 1; ; attempt++) {
      const before = (await status()).angle
      await ann.mouse.move(...(await center(forward)))
      await ann.mouse.down()
      await ann.waitForTimeout(time)
      const { doing, angle, last } = await status()
      if (doing?.what === 'jog' && angle > before + 0.5) return
      assert.ok(attempt < 4 && /no signal/.test(last?.error ?? ''), `${before} to ${angle}: ${doing?.what}, ${last?.error}`)
      await ann.mouse.up()
      await rest()
    }
  }
  const summary = (kind) => {
    const runs = join(scene.project, 'runs')
    const folder = readdirSync(runs).filter((name) => name.includes(kind)).sort().at(-1)
    return JSON.parse(readFileSync(join(runs, folder, 'summary.json'), 'utf8')).results
  }
  const idle = async () => {
    while ((await status()).doing) await ann.waitForTimeout(100)
  }

  await scene.step('before homing the axis cannot be moved, and the window shows why', async () => {
    // Collects the connections of the page, to break them.
    await ann.addInitScript(() => {
      const Original = WebSocket
      window.sockets = []
      window.WebSocket = class extends Original {
        constructor(...all) {
          super(...all)
          window.sockets.push(this)
        }
      }
    })
    await ann.goto(scene.bench.address.href)
    await state(ann).getByText('Off').waitFor()
    await ann.keyboard.press('5')
    await ann.getByText(/^No trial/).waitFor()
    assert.ok(await forward.isDisabled())
    assert.equal(await forward.getAttribute('title'), 'Home the axis first')
    await scene.snapshot(ann, 'test-empty')
    await button('Home axis').click()
    await state(ann).getByText('Running').waitFor()
    await idle()
  })
  await scene.step('the axis moves while the button is held, and rests after the release', async () => {
    await ann.getByRole('main').locator('input[inputmode=decimal]').first().waitFor()
    // A pause of a busy machine ends a jog like a lost connection: another attempt.
    for (let attempt = 0; attempt === 0 || ((await status()).last.error !== null && attempt < 3); attempt++) {
      await hold()
      await ann.mouse.up()
      await rest()
    }
    assert.equal((await status()).last.error, null)
  })
  await scene.step('outside the button, without focus, with a second pointer and with another mouse button the axis comes to rest', async () => {
    const releases = [
      () => ann.mouse.move(300, 300, { steps: 3 }),
      () => ann.evaluate(() => window.dispatchEvent(new Event('blur'))),
      () => ann.evaluate(() => document.body.dispatchEvent(new PointerEvent('pointerdown', { pointerId: 77, bubbles: true }))),
      () => ann.mouse.down({ button: 'right' }).then(() => ann.mouse.up({ button: 'right' })),
    ]
    for (const release of releases) {
      await hold(400)
      await release()
      // The left button is still pressed.
      const angle = await rest()
      await ann.waitForTimeout(300)
      assert.ok(Math.abs((await status()).angle - angle) < 0.1)
      await ann.mouse.up()
    }
  })
  await scene.step('the arrow keys jog while they are held; after Stop a held key does not start the axis again', async () => {
    await ann.locator('h1').click()
    const before = await rest()
    await ann.keyboard.down('ArrowLeft')
    await ann.waitForTimeout(600)
    await ann.keyboard.up('ArrowLeft')
    assert.ok((await rest()) < before - 1)
    await ann.keyboard.down('ArrowRight')
    await ann.waitForTimeout(400)
    await ann.keyboard.press('F8')
    await state(ann).getByText('Ready').waitFor()
    await button('Torque on').click()
    await state(ann).getByText('Running').waitFor()
    const angle = await rest()
    // A key that is held repeats.
    for (let k = 0; k < 5; k++) await ann.keyboard.down('ArrowRight')
    await ann.waitForTimeout(300)
    assert.ok(Math.abs((await status()).angle - angle) < 0.1)
    await ann.keyboard.up('ArrowRight')
  })
  await scene.step('a lost connection and a closed tab stop the axis; after the reconnection it stays at rest', async () => {
    await hold()
    await scene.unreachable(async () => {
      await ann.evaluate(() => window.sockets.forEach((socket) => socket.close()))
      await rest()
      await ann.getByText('You have control').waitFor()
    })
    const angle = await rest()
    await ann.waitForTimeout(400)
    assert.ok(Math.abs((await status()).angle - angle) < 0.1, 'the mouse button is still pressed')
    await ann.mouse.up()
    assert.match((await status()).last.error ?? 'jog ended', /no signal for 0.3 s|jog ended/)
    const second = await ann.context().newPage()
    await second.goto(`${scene.bench.address.origin}/test`)
    const other = second.getByRole('button', { name: 'Jog forward' })
    await other.and(second.locator(':enabled')).waitFor()
    const { x, y, width, height } = await other.boundingBox()
    await second.mouse.move(x + width / 2, y + height / 2)
    await second.mouse.down()
    await second.waitForTimeout(500)
    assert.equal((await status()).doing?.what, 'jog')
    await second.close()
    await rest()
  })
  await scene.step('a viewer sees the motion and cannot jog', async () => {
    const bob = await scene.page('Bob')
    await bob.goto(`${scene.bench.address.href}`)
    await bob.keyboard.press('5')
    await bob.getByText('Ann has control').first().waitFor()
    const other = bob.getByRole('button', { name: 'Jog forward' })
    assert.ok(await other.isDisabled())
    assert.equal(await other.getAttribute('title'), 'Ann has control')
    await scene.unreachable(async () => assert.match((await caller(bob, 'Bob')({ call: 'jog', velocity: 5, press: 1 })).error, /Ann is the operator/))
    await bob.context().close()
  })
  await scene.step('the axis goes to a position in the unit of the page; outside the travel it is refused with the range', async () => {
    const field = ann.getByRole('textbox', { name: /^Go to/ })
    await field.fill('300')
    await field.press('Enter')
    await ann.getByText(/300 mm is outside the travel: .124.5 to 124.5 mm/).waitFor()
    await field.fill('somewhere')
    await field.press('Enter')
    await ann.getByText(/Enter a number in mm/).waitFor()
    await field.fill('1,5')
    await field.press('Enter')
    await ann.waitForFunction(() => !document.querySelector('main [role=alert]'))
    await ann.waitForTimeout(300)
    await idle()
    const angle = await rest()
    assert.ok(Math.abs(angle * (5 / (2 * Math.PI)) - 1.5) < 0.1, `${angle} rad`)
  })
  await scene.step('a manoeuvre gives a row with the numbers of its run, and the curves', async () => {
    await ann.getByRole('combobox', { name: 'Manoeuvre' }).selectOption('sine_2hz')
    const repetitions = ann.getByRole('textbox', { name: 'Repetitions' }).first()
    await repetitions.fill('2')
    await repetitions.press('Tab')
    // The page may show the end of the last motion a little later.
    await ann.getByRole('main').getByRole('button', { name: /^Run R/, disabled: false }).waitFor()
    await ann.keyboard.press('r')
    await ann.getByRole('region', { name: 'Progress' }).getByText(/repetition 1 of 2/).waitFor()
    await rows.first().waitFor()
    const shown = Number((await rows.first().locator('td').nth(6).innerText()).split('±')[0])
    const error = 1e3 * summary('test-sine')['trial.tracking_rms'].value
    assert.ok(Math.abs(shown / error - 1) < 0.01, `${shown} mrad, ${error} mrad in the summary`)
    await ann.getByRole('img', { name: /deviation e over time/ }).waitFor()
    assert.equal(await ann.getByRole('combobox', { name: 'Repetition', exact: true }).locator('option').count(), 2)
  })
  await scene.step('with another gain the new trial is B: percentages and the difference below', async () => {
    await call({ call: 'set', values: { 'bench.controller.position_gain': '8' } })
    await button(/^Run/).click()
    await ann.getByRole('radio', { name: /^B: run/ }).first().and(ann.locator(':checked')).waitFor()
    await ann.getByRole('img', { name: /Difference B − A.*mrad RMS/ }).waitFor()
    const row = ann.getByRole('region', { name: 'A and B' }).getByRole('row', { name: /tracking, RMS/ })
    const [a, b, percent] = (await row.locator('td').allInnerTexts()).map((text) => parseFloat(text.replace('−', '-').replace('+', '')))
    assert.ok(Math.abs(100 * (b / a - 1) - percent) < 2 && percent > 10, `${a}, ${b}, ${percent} %`)
    await scene.snapshot(ann, 'test-pair')
    for (const signal of ['Position', 'Speed', 'Torque', 'Deviation']) {
      await ann.getByRole('region', { name: 'Curves' }).getByRole('button', { name: signal, exact: true }).click()
      await ann.waitForTimeout(150)
    }
    await call({ call: 'undo' })
  })
  await scene.step('steps of 10 µm settle; positions of a file are followed; an invalid file is refused', async () => {
    await ann.getByRole('combobox', { name: 'Manoeuvre' }).selectOption('step_10um')
    await ann.getByRole('textbox', { name: 'Repetitions' }).first().fill('1')
    await button(/^Run/).click()
    await rows.getByText('Steps of 10 µm').waitFor()
    await idle()
    const path = join(scene.project, 'ramp.csv')
    writeFileSync(path, `time [s],position [mm]\n${Array.from({ length: 101 }, (_, k) => `${k / 100},${k / 200}`).join('\n')}\n`)
    await ann.getByRole('combobox', { name: 'Manoeuvre' }).selectOption('file')
    assert.ok(await button(/^Run/).isDisabled())
    await ann.locator('input[type=file]').setInputFiles(path)
    await button(/^Run/).click()
    await rows.getByText('ramp.csv').waitFor()
    await idle()
    writeFileSync(path, 'time,position\n0,1\n1,2\n5,3\n')
    await ann.locator('input[type=file]').setInputFiles([])
    await ann.locator('input[type=file]').setInputFiles(path)
    await button(/^Run/).click()
    await ann.getByText(/equal steps of time/).first().waitFor()
  })
  await scene.step('with rendered friction the row names it; a friction that cannot be rendered is not offered', async () => {
    const rendered = ann.getByRole('group', { name: 'Friction of motions' }).getByRole('button', { name: 'Rendered' })
    assert.ok(await rendered.isDisabled(), 'at 1 kHz the desired friction of the preset cannot be rendered')
    const items = (await call({ call: 'items' })).items
    const own = Object.fromEntries(['breakaway_torque', 'kinetic_torque', 'stribeck_velocity', 'viscous_friction'].map((name) => [`bench.desired.${name}`, String(items.find((item) => item.path === `model.own.${name}`).value)]))
    assert.equal((await call({ call: 'set', values: own })).answer, 'entered')
    await rendered.and(ann.locator(':enabled')).click()
    await ann.getByRole('combobox', { name: 'Manoeuvre' }).selectOption('sine_2hz')
    await button(/^Run/).click()
    await rows.getByText(/^rendered, /).first().waitFor()
    await idle()
    await ann.getByRole('group', { name: 'Friction of motions' }).getByRole('button', { name: 'Own' }).click()
  })
  await scene.step('controllers are compared on the same friction; the ranking has intervals', async () => {
    await ann.locator('h1').click()
    await ann.keyboard.press('c')
    const compare = ann.getByRole('region', { name: 'Compare controllers' })
    await compare.getByRole('checkbox', { name: 'state-feedback', exact: true }).uncheck()
    await compare.getByRole('button', { name: /^Compare, / }).and(ann.locator(':disabled')).waitFor()
    await compare.getByRole('checkbox', { name: 'pid', exact: true }).check()
    await compare.getByRole('textbox', { name: 'Repetitions' }).fill('2')
    await compare.getByRole('textbox', { name: 'Repetitions' }).press('Tab')
    await scene.snapshot(ann, 'test-compare')
    await compare.getByRole('button', { name: /^Compare, / }).click()
    await ann.getByRole('region', { name: 'Progress' }).getByText(/pid, 2 of 2/).waitFor({ timeout: 120_000 })
    const ranking = ann.getByRole('region', { name: 'Ranking' })
    await ranking.getByRole('row', { name: /pid/ }).waitFor({ timeout: 60_000 })
    await idle()
    const texts = await ranking.locator('tbody tr').allInnerTexts()
    assert.equal(texts.length, 2)
    assert.ok(texts.every((text) => /±/.test(text)), texts.join())
    assert.equal(summary('comparison')['benchmark.complete'].value, 1)
    await scene.snapshot(ann, 'test-ranking')
    assert.equal((await call({ call: 'items' })).items.find((item) => item.path === 'bench.controller.kind').choice, 'cascade')
    await rows.getByText('pid', { exact: true }).first().waitFor()
  })
  await scene.step('a comparison can be cancelled', async () => {
    await ann.getByRole('button', { name: /^Compare, / }).click()
    const progress = ann.getByRole('region', { name: 'Progress' })
    await progress.getByText(/1 of 2: /).waitFor({ timeout: 60_000 })
    await progress.getByRole('button', { name: 'Cancel' }).click()
    await progress.waitFor({ state: 'detached' })
    assert.equal((await status()).state, 'running')
  })
  await scene.step('the table is exported; a trial opens in Runs', async () => {
    const [download] = await Promise.all([ann.waitForEvent('download'), ann.getByRole('button', { name: 'Table as CSV' }).click()])
    const text = readFileSync(await download.path(), 'utf8')
    assert.match(text, /^run,motion,controller,friction,repetitions,"?tracking, RMS \[mrad\]/)
    assert.ok(text.trim().split('\n').length >= 6)
    await button('Trials').click()
    for (const [kind, content] of [['SVG', /<svg/], ['CSV', /,/], ['PNG', /PNG/]]) {
      await ann.getByRole('button', { name: 'Export curves' }).click()
      const [picture] = await Promise.all([ann.waitForEvent('download'), ann.getByRole('button', { name: kind, exact: true }).click()])
      assert.match(readFileSync(await picture.path(), 'latin1'), content)
    }
    const link = rows.last().getByRole('link')
    const run = await link.innerText()
    await link.click()
    await ann.getByRole('heading', { name: 'Runs' }).waitFor()
    assert.equal(new URL(ann.url()).search, `?run=${run}`)
    await ann.getByRole('complementary').getByText('trial.tracking_rms').waitFor()
    // The inspector begins with the figure.
    const figure = ann.getByRole('complementary').getByRole('img', { name: `trial.svg of run ${run}` })
    await figure.waitFor()
    await ann.waitForFunction((image) => image.complete && image.naturalWidth > 0, await figure.elementHandle())
    await scene.snapshot(ann, 'test-run')
    await ann.getByRole('row').filter({ hasText: 'controllers compared' }).first().click()
    await ann.getByRole('complementary').getByRole('img', { name: /^sine_2hz.svg of run/ }).waitFor()
    await scene.snapshot(ann, 'test-run-comparison')
  })
  await scene.step('on narrow screens the jog buttons are in reach', async () => {
    for (const [width, height] of [[390, 844], [820, 1180]]) {
      await ann.setViewportSize({ width, height })
      await ann.goto(`${scene.bench.address.origin}/test`)
      await forward.scrollIntoViewIfNeeded()
      const box = await forward.boundingBox()
      assert.ok(box.x >= 0 && box.x + box.width <= width && box.height >= 40, JSON.stringify(box))
      assert.ok(await ann.evaluate(() => document.documentElement.scrollWidth <= document.documentElement.clientWidth))
      if (process.env.SHOTS) await ann.screenshot({ path: join(process.env.SHOTS, `test-${width}.png`) })
    }
  })
})
