// Breakaway and presliding from plan to download, the preload that is advised, what was lost, points by keyboard.

import assert from 'node:assert/strict'
import { play } from './harness.mjs'

await play(async (scene) => {
  const ann = await scene.page('Ann')
  const call = (body) =>
    ann.evaluate(async (body) => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': 'Ann' }, body })
      return response.json()
    }, JSON.stringify(body))
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

  await scene.step('breakaway: its plan, the ramps as they come, the result with its interval', async () => {
    await ann.goto(scene.bench.address.href)
    await ann.keyboard.press('2')
    await tab('Over speed').focus()
    await ann.keyboard.press('ArrowRight')
    await ann.keyboard.press('ArrowRight')
    assert.equal(await tab('Breakaway').getAttribute('aria-selected'), 'true')
    await ann.getByText(/until the load breaks away/).waitFor()
    await scene.seen(ann, 'breakaway-empty')
    await fill([[/rate/, '0.2'], [/angles/, '1'], [/repetitions/, '1']])
    await ann.getByText(/1 ramps of 0.2/).waitFor()
    await ann.getByRole('button', { name: 'Measure breakaway' }).click()
    const card = ann.getByRole('region', { name: 'Breakaway', exact: true })
    await ann.getByRole('img', { name: /Breakaway torque over the turn/ }).waitFor()
    await card.getByText('run 1').waitFor()
    const found = await call({ call: 'at_rest', what: 'breakaway' })
    const [key] = found.keys
    assert.ok((await card.innerText()).includes(`${key.value} ± ${key.half_width}`))
    await scene.seen(ann, 'breakaway-done')
  })
  await scene.step('another rate stands beside it, and the torque is downloaded', async () => {
    await fill([[/rate/, '0.15']])
    await ann.getByText(/ramps of 0.15 N/).waitFor()
    await ann.getByRole('button', { name: /^Measure again/ }).first().click()
    await ann.getByRole('region', { name: 'Breakaway', exact: true }).getByText('run 2').waitFor()
    await ann.getByRole('region', { name: /over the rate of the ramp/ }).waitFor()
    await scene.seen(ann, 'breakaway-rates')
    await ann.getByRole('button', { name: /Download to target/ }).click()
    const dialog = ann.getByRole('dialog', { name: /Download own friction/ })
    await dialog.getByText(/breakaway torque/).waitFor()
    await dialog.getByRole('button', { name: /^Download \d/ }).click()
    await ann.getByText('These values are on the target').waitFor()
  })
  await scene.step('presliding: the loops over the displacement, and what they tell', async () => {
    await tab('Presliding').click()
    await ann.getByText(/rock the load on its bristles/).waitFor()
    await ann.getByRole('button', { name: 'Measure presliding' }).click()
    await ann.getByRole('img', { name: /Measured friction/ }).waitFor()
    const last = await ended()
    assert.equal(last.error, null)
    await ann.getByRole('img', { name: /Presliding/ }).waitFor()
    const found = await call({ call: 'at_rest', what: 'presliding' })
    assert.ok(found.keys.length >= 1 && found.figures.length === 1)
    await ann.getByRole('region', { name: 'Presliding', exact: true }).getByText(found.keys[0].name, { exact: true }).waitFor()
    await scene.seen(ann, 'presliding-done')
  })
  await scene.step('arrow keys walk over measured points and tell each', async () => {
    await tab('Over speed').click()
    const plan = { slowest: '2', fastest: '40', speeds: '5' }
    await call({ call: 'measure', what: 'friction', plan })
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
    await scene.seen(ann, 'friction-walk')
  })
  await scene.step('a desired friction that needs the wheel: which preload, set, and known from two curves', async () => {
    await call({ call: 'set', values: { 'bench.desired.breakaway_torque': '0.2' } })
    await ann.keyboard.press('3')
    const wheel = ann.getByRole('group', { name: /Preload of the friction wheel/ })
    await wheel.getByText(/friction wheel is needed/).waitFor()
    await call({ call: 'preload', preload: 0.2 })
    await ended()
    await call({ call: 'measure', what: 'friction', plan: { slowest: '2', fastest: '40', speeds: '5' } })
    await ended()
    await wheel.getByText(/Preload 0?\.?\d+ is advised/).waitFor()
    const { preload } = await call({ call: 'advise_preload' })
    await wheel.scrollIntoViewIfNeeded()
    await scene.seen(ann, 'design-preload')
    await wheel.getByRole('button', { name: `Set ${preload}` }).click()
    await ann.getByText(`Linings pressed on to ${preload}`).waitFor()
    await wheel.waitFor({ state: 'detached' })
    assert.equal((await call({ call: 'status' })).preload, preload)
    // The same word at the machine's part.
    await ann.keyboard.press('1')
    await ann.getByRole('button', { name: /^Friction wheel/ }).press('Enter')
    await ann.getByRole('complementary', { name: /Friction wheel/ }).getByText(/desired one|own friction|brings it/).first().waitFor()
    await ann.keyboard.press('Escape')
    await call({ call: 'status' })
  })
  await scene.step('the counters open what was lost, by keyboard', async () => {
    const lost = ann.getByRole('button', { name: /lost samples/ })
    await lost.press('Enter')
    const list = ann.getByRole('group', { name: /recorders and viewers did not get/ })
    await list.getByText(/No cycle was lost|The loop itself went on/).first().waitFor()
    await scene.seen(ann, 'losses')
    await list.getByRole('button', { name: 'Close' }).click()
    await list.waitFor({ state: 'detached' })
    await ann.getByRole('button', { name: /held cycles/ }).press('Enter')
    await ann.getByRole('group', { name: /deadline was missed/ }).waitFor()
  })
})
