// Another controller, selected on Home while the axis is homed: it becomes active, and its parameters can be changed.

import assert from 'node:assert/strict'
import { confirmDownload, downloadEntered, play } from './harness.mjs'

await play(async (scene) => {
  const ann = await scene.page('Ann')
  await scene.step('state feedback becomes active and shows its own choices', async () => {
    await ann.goto(scene.bench.address.href)
    await ann.getByRole('main').getByRole('button', { name: 'Home axis' }).first().click()
    await ann.getByText('Homed', { exact: true }).waitFor()
    await ann.getByLabel('Control', { exact: true }).selectOption('state-feedback')
    await confirmDownload(ann)
    await ann.getByText(/active on the target since cycle/).waitFor()
    await ann.getByRole('region', { name: 'Experiment' }).getByRole('button', { name: 'Controller', exact: true }).click()
    await ann.getByLabel(/integral time/).waitFor()
    await ann.getByLabel('kind', { exact: true }).nth(1).selectOption('poles')
    await downloadEntered(ann)
    await ann.getByLabel(/vibration damping/).waitFor()
    assert.equal(await ann.getByLabel(/integral time/).count(), 0)
    await scene.snapshot(ann, 'state-feedback')
  })
})
