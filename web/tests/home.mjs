// Home: the eight controls of the paper in view, the count of changed values, and the end of the program.

import assert from 'node:assert/strict'
import { caller, play, state } from './harness.mjs'

/** Figure 9 of the paper. */
const NAMES = ['Controller Design', 'Friction Measurement', 'Friction Design', 'Simulation', 'Implementation', 'Help', 'Close']

await play(async (scene) => {
  const ann = await scene.page('Ann')
  ann.setDefaultTimeout(15_000)
  const call = caller(ann)
  const experiment = ann.getByRole('region', { name: 'Experiment' })

  await scene.step('the eight controls and the guided experiment are in view, and the scope is collapsed', async () => {
    await ann.goto(scene.bench.address.href)
    await experiment.getByLabel('Control', { exact: true }).waitFor()
    for (const [width, height] of [[1440, 900], [1280, 800]]) {
      await ann.setViewportSize({ width, height })
      const controls = [experiment.getByLabel('Control', { exact: true }), ...NAMES.map((name) => experiment.getByRole('button', { name: new RegExp(`^${name}`) })), experiment.getByRole('list', { name: 'Guided experiment' })]
      const bottom = (await ann.getByRole('region', { name: 'Scope' }).boundingBox()).y
      for (const control of controls) {
        const box = await control.boundingBox()
        assert.ok(box.y > 52 && box.y + box.height <= bottom, `${await control.innerText()} ends at ${box.y + box.height} of ${bottom}`)
      }
    }
    await ann.setViewportSize({ width: 1440, height: 900 })
    await scene.snapshot(ann, 'home-eight')
  })
  await scene.step('the tile counts the values of the controller, the list all of them', async () => {
    await call({ call: 'set', values: { 'bench.controller.position_gain': '12', 'bench.controller.velocity_gain': '0.1', 'bench.safety.missed_ticks': '400' } })
    await experiment.getByRole('button', { name: /^Controller Design.*cascade, 2 values changed/ }).waitFor()
    const list = experiment.getByRole('button', { name: '3 values changed since the start' })
    await list.click()
    const dialog = ann.getByRole('dialog', { name: '3 values changed since the start' })
    assert.equal(await dialog.locator('tbody tr').count(), 3)
    await dialog.getByText('bench.safety.missed_ticks').waitFor()
    await scene.snapshot(ann, 'home-changes')
    await dialog.getByRole('button', { name: 'Restore the values of the start' }).click()
    await dialog.waitFor({ state: 'detached' })
    await experiment.getByRole('button', { name: '0 values changed since the start' }).waitFor()
    assert.equal((await call({ call: 'status' })).changed, 0)
  })
  await scene.step('Close stops the axis and ends the program', async () => {
    await call({ call: 'home' })
    await ann.getByText('Homed', { exact: true }).waitFor()
    await state(ann).getByText('Running').waitFor()
    let refused
    await scene.unreachable(async () => (refused = await call({ call: 'close' })))
    assert.match(JSON.stringify(refused), /Stop the axis before you end the program/)
    await experiment.getByRole('button', { name: /^Close/ }).click()
    const dialog = ann.getByRole('dialog', { name: 'Close' })
    await scene.snapshot(ann, 'home-close')
    await scene.unreachable(async () => {
      await dialog.getByRole('button', { name: 'Stop and end the program' }).click()
      await ann.getByText(/The program has ended/).waitFor()
      await state(ann).getByText('Offline').waitFor()
      assert.equal(await scene.bench.ended, 0)
      await scene.serve(scene.bench.address.host)
    })
  })
})
