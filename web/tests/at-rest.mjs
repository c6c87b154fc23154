// Breakaway and presliding from plan to download, the recommended preload, lost and missed cycles, points by keyboard.

import assert from 'node:assert/strict'
import { caller, play } from './harness.mjs'

const PLAN = { slowest: '3', fastest: '40', speeds: '5', settling_time: '0.1' }

await play(async (scene) => {
  const ann = await scene.page('Ann')
  const call = caller(ann)
  const ended = async () => {
    for (;;) {
      const { doing, last } = await call({ call: 'status' })
      if (!doing) return last
      await ann.waitForTimeout(100)
    }
  }
  const tab = (name) => ann.getByRole('tab', { name })
  const fill = async (values) => {
    await ann.getByRole('button', { name: /^(Quick|Thorough)/ }).first().click()
    for (const [name, value] of values) {
      await ann.getByRole('textbox', { name }).fill(value)
      await ann.getByRole('textbox', { name }).press('Enter')
    }
  }

  await scene.step('breakaway: plan, growing ramps, result with interval', async () => {
    await ann.goto(scene.bench.address.href)
    await ann.keyboard.press('2')
    await tab('Over speed').focus()
    await ann.keyboard.press('ArrowRight')
    await ann.keyboard.press('ArrowRight')
    assert.equal(await tab('Breakaway').getAttribute('aria-selected'), 'true')
    await ann.getByText(/until the load breaks away/).waitFor()
    await scene.snapshot(ann, 'breakaway-empty')
    await fill([[/rate/, '0.2'], [/angles/, '1'], [/repetitions/, '1']])
    await ann.getByText(/1 ramps of 0.2/).waitFor()
    await ann.getByRole('button', { name: 'Measure breakaway' }).click()
    const card = ann.getByRole('region', { name: 'Breakaway', exact: true })
    await ann.getByRole('img', { name: /Breakaway torque over the turn/ }).waitFor()
    await card.getByText('run 1').waitFor()
    const result = await call({ call: 'at_rest', what: 'breakaway' })
    const [key] = result.keys
    assert.ok((await card.innerText()).includes(`${key.value} ± ${key.half_width}`))
    await scene.snapshot(ann, 'breakaway-done')
  })
  await scene.step('a second rate is compared with the first, and the torque is downloaded', async () => {
    await fill([[/rate/, '0.15']])
    await ann.getByText(/ramps of 0.15 N/).waitFor()
    await ann.getByRole('button', { name: /^Measure again/ }).first().click()
    await ann.getByRole('region', { name: 'Breakaway', exact: true }).getByText('run 2').waitFor()
    await ann.getByRole('region', { name: /over the rate of the ramp/ }).waitFor()
    await scene.snapshot(ann, 'breakaway-rates')
    await ann.getByRole('button', { name: /Download to target/ }).click()
    const dialog = ann.getByRole('dialog', { name: /Download own friction/ })
    await dialog.getByText(/breakaway torque/).waitFor()
    await dialog.getByRole('button', { name: /^Download \d/ }).click()
    await ann.getByText('The target has these values').waitFor()
  })
  await scene.step('presliding: loops over the displacement, and key numbers', async () => {
    await tab('Presliding').click()
    await ann.getByText(/deflect the load without breakaway/).waitFor()
    await ann.getByRole('button', { name: 'Measure presliding' }).click()
    await ann.getByRole('img', { name: /Measured friction/ }).waitFor()
    const last = await ended()
    assert.equal(last.error, null)
    await ann.getByRole('img', { name: /Presliding/ }).waitFor()
    const result = await call({ call: 'at_rest', what: 'presliding' })
    assert.ok(result.keys.length >= 1 && result.figures.length === 1)
    await ann.getByRole('region', { name: 'Presliding', exact: true }).getByText(result.keys[0].name, { exact: true }).waitFor()
    await scene.snapshot(ann, 'presliding-done')
  })
  await scene.step('arrow keys move along the measured points and read their values', async () => {
    await tab('Over speed').click()
    await call({ call: 'measure', what: 'friction', plan: PLAN })
    await ended()
    const points = ann.getByRole('slider', { name: /Points of Friction torque/ })
    await ann.getByRole('button', { name: /Download to target/ }).waitFor()
    await points.focus()
    await ann.keyboard.press('End')
    assert.match(await points.getAttribute('aria-valuetext'), /^4\d\.\d+ rad\/s|^39\.\d+ rad\/s/)
    await ann.keyboard.press('ArrowLeft')
    const { points: measured } = await call({ call: 'curve' })
    assert.equal(Number(await points.getAttribute('aria-valuenow')), measured.length - 1)
    const [, second] = measured.toSorted((a, b) => b.velocity - a.velocity)
    assert.ok((await points.getAttribute('aria-valuetext')).includes(second.torque.toFixed(4)))
    await scene.snapshot(ann, 'friction-walk')
  })
  await scene.step('a desired friction requires the wheel: the preload is recommended from two curves and set', async () => {
    await call({ call: 'set', values: { 'bench.desired.breakaway_torque': '0.2' } })
    await ann.keyboard.press('3')
    const wheel = ann.getByRole('group', { name: /Preload of the friction wheel/ })
    await wheel.getByText(/^The friction wheel is required$/).waitFor()
    await call({ call: 'preload', preload: 0.2 })
    await ended()
    await call({ call: 'measure', what: 'friction', plan: PLAN })
    await ended()
    await wheel.getByText(/^Recommended preload: [\d.]+$/).waitFor()
    const { preload } = await call({ call: 'advise_preload' })
    await wheel.scrollIntoViewIfNeeded()
    await scene.snapshot(ann, 'design-preload')
    await wheel.getByRole('button', { name: `Set ${preload}` }).click()
    await ann.getByText(`Friction wheel preload set to ${preload}`).waitFor()
    await wheel.waitFor({ state: 'detached' })
    assert.equal((await call({ call: 'status' })).preload, preload)
    // The same recommendation at the part of the machine.
    await ann.keyboard.press('1')
    await ann.getByRole('button', { name: /^Friction wheel/ }).press('Enter')
    await ann.getByRole('complementary', { name: /Friction wheel/ }).getByText(/desired one|own friction|brings it/).first().waitFor()
    await ann.keyboard.press('Escape')
    await call({ call: 'status' })
  })
  await scene.step('the counters show lost and missed cycles, by keyboard', async () => {
    const lost = ann.getByRole('button', { name: /lost samples/ })
    await lost.press('Enter')
    const list = ann.getByRole('group', { name: /not delivered to recorders or viewers/ })
    await list.getByText(/No lost samples|The loop/).first().waitFor()
    await scene.snapshot(ann, 'losses')
    await list.getByRole('button', { name: 'Close' }).click()
    await list.waitFor({ state: 'detached' })
    await ann.getByRole('button', { name: /missed cycles/ }).press('Enter')
    await ann.getByRole('group', { name: /missed deadline/ }).waitFor()
  })
})
