// The experiment of the paper on a first visit, from a bench that is off to a report and a comparison; the test counts clicks.
// With REAL=1 the quick plan at the rate of the preset, otherwise a short plan.

import assert from 'node:assert/strict'
import { readFileSync, readdirSync } from 'node:fs'
import { join } from 'node:path'
import { caller, play, state } from './harness.mjs'

const real = Boolean(process.env.REAL)
/** Maximum number of clicks. */
const BUDGET = 25
/** Maximum duration of the real experiment [s]. */
const LONGEST = 240
const PATIENCE = 90_000

await play(
  async (scene) => {
    const ann = await scene.page('Ann')
    let clicks = 0
    const click = async (locator) => {
      await locator.click({ timeout: real ? PATIENCE : 90_000 })
      clicks += 1
    }
    const button = (name) => ann.getByRole('button', { name })
    const dialog = ann.getByRole('dialog')
    const summary = (kind) => {
      const runs = join(scene.project, 'runs')
      const folder = readdirSync(runs).filter((name) => name.endsWith(kind)).sort().at(-1)
      return JSON.parse(readFileSync(join(runs, folder, 'summary.json'), 'utf8')).results
    }
    if (!real)
      await ann.addInitScript(() => localStorage.setItem('stickslip.friction', '{"thorough":false,"values":{"slowest":"2","fastest":"40","speeds":"5"}}'))
    const start = Date.now()

    await scene.step('homing, measurement, download of the own friction', async () => {
      await ann.goto(scene.bench.address.href)
      await click(ann.getByRole('main').getByRole('button', { name: 'Home axis' }).first())
      await ann.getByText('Homed', { exact: true }).waitFor()
      await click(ann.getByRole('button', { name: /Friction Measurement/ }))
      await click(ann.getByRole('button', { name: /Measure now/ }))
      await click(button(/Download to target/))
      await click(dialog.getByRole('button', { name: /^Download \d/ }))
    })
    await scene.step('four points and a handle define the desired friction, which is downloaded', async () => {
      await click(button('Next: Friction Design').last())
      const sheet = ann.locator('.sheet')
      await sheet.waitFor()
      const { x, y, width, height } = await sheet.boundingBox()
      for (const [across, down] of [[0.01, 0.3], [0.25, 0.56], [0.5, 0.52], [0.8, 0.42]]) {
        await ann.mouse.click(x + across * width, y + down * height)
        clicks += 1
      }
      await ann.getByRole('slider', { name: 'Reference point 4' }).waitFor()
      const grip = await ann.getByRole('slider', { name: 'Kinetic torque' }).boundingBox()
      await ann.mouse.move(grip.x + grip.width / 2, grip.y + grip.height / 2)
      await ann.mouse.down()
      await ann.mouse.move(grip.x + grip.width / 2, grip.y + grip.height / 2 + 12, { steps: 4 })
      await ann.mouse.up()
      clicks += 1
      await ann.getByRole('status').getByText('checking').waitFor({ state: 'hidden' })
      if (await ann.getByRole('region', { name: 'Renderability' }).getByText('Not renderable').count()) await click(button(/Nearest renderable/))
      await scene.snapshot(ann, 'newcomer-design')
      await click(button(/^Download \d+ changes/))
      await click(dialog.getByRole('button', { name: /^Download \d/ }))
    })
    await scene.step('a measurement with the load motor rendering gives figures 12 to 14', async () => {
      await click(button('Measure again (axis moves)').last())
      await state(ann).getByText('Measuring').waitFor()
      await ann.getByRole('img', { name: /Desired and rendered friction/ }).waitFor()
      await scene.accessible(ann, 'rendering')
      if (process.env.SHOTS) await ann.screenshot({ path: join(process.env.SHOTS, 'newcomer-rendering.png') })
      await button('Save report').waitFor({ timeout: PATIENCE })
      const shown = await ann.getByRole('region', { name: 'Rendered friction' }).locator('dd').first().innerText()
      const error = summary('render')['render.rms_error'].value
      const [, value, unit] = shown.match(/^([\d.]+)(?: ± [\d.]+)? ([mµ]?)N·m/)
      assert.ok(Math.abs(Number(value) * { '': 1, m: 1e-3, µ: 1e-6 }[unit] - error) <= 0.5 * error, `${shown} is ${error}`)
      await scene.snapshot(ann, 'newcomer-rendered')
      for (const [tab, title] of [['Load torque', /Difference torque/], ['Own and desired', /Own friction and desired/]]) {
        await ann.getByRole('tab', { name: tab }).click()
        await ann.getByRole('img', { name: title }).waitFor()
        await scene.snapshot(ann, `newcomer-${tab.toLowerCase().replaceAll(' ', '-')}`)
      }
    })
    await scene.step('the report is a separate page and requires the token', async () => {
      const [report] = await Promise.all([ann.context().waitForEvent('page'), click(button('Save report'))])
      await report.getByText('figure 14 of the paper').first().waitFor()
      assert.match(report.url(), /\/report\/\d+$/)
      await scene.accessible(report, 'report')
      const path = new URL(report.url()).pathname
      await report.close()
      assert.equal((await fetch(new URL(path, scene.bench.address.origin))).status, 401)
      await scene.unreachable(async () => {
        for (const wrong of ['/report/..%2f..%2fserve-token', '/report/1/../../serve-token', '/report/-1', '/report/77'])
          assert.doesNotMatch(await ann.evaluate(async (wrong) => (await fetch(wrong)).text(), wrong), /figure 14|^[0-9a-f]{16,}/, wrong)
      })
      assert.equal(await ann.locator('main ol li.done').count(), 8)
    })
    await scene.step('two controllers are compared on the rendered friction', async () => {
      await click(button('Next: compare controllers'))
      await ann.getByRole('button', { name: 'Rendered', exact: true }).and(ann.locator('[aria-pressed=true]')).waitFor()
      await click(button(/^Compare, /))
      const ranking = ann.getByRole('region', { name: 'Ranking' })
      await ranking.getByRole('row', { name: /state-feedback/ }).waitFor({ timeout: 2 * PATIENCE })
      assert.equal(await ranking.locator('tbody tr').count(), 2)
      await scene.snapshot(ann, 'newcomer-compared')
      await ann.keyboard.press('1')
      await ann.getByText('9 of 9 steps done').waitFor()
    })
    const seconds = (Date.now() - start) / 1000
    console.log(`${clicks} clicks, ${seconds.toFixed(0)} s`)
    if (real) assert.ok(seconds <= LONGEST, `${seconds} s`)
    assert.ok(clicks <= BUDGET, `${clicks} clicks`)
    await scene.step('"Measure again" measures what the tab shows', async () => {
      await ann.keyboard.press('2')
      await ann.getByRole('tab', { name: 'Desired and measured' }).click()
      await button(/Measure again R/).click()
      for (;;) {
        const { measuring, rendered } = await caller(ann)({ call: 'curve' })
        if (measuring) {
          assert.ok(rendered, 'with the load motor rendering')
          break
        }
        await ann.waitForTimeout(50)
      }
      await ann.getByRole('tab', { name: 'Desired and measured', selected: true }).waitFor()
      await caller(ann)({ call: 'halt' })
    })
  },
  ...(real ? [process.env.REAL.split(',').filter((value) => value.includes('='))] : []),
)
