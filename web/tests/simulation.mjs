// A recorded run on the virtual bench, with other parameters.

import assert from 'node:assert/strict'
import { play, state } from './harness.mjs'

await play(async (scene) => {
  const ann = await scene.page('Ann')
  const call = (body) =>
    ann.evaluate(async (body) => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': 'Ann' }, body: JSON.stringify(body) })
      return response.json()
    }, body)
  const status = ann.getByRole('main').getByRole('status')
  const torque = ann.getByRole('row', { name: /^Torque/ })

  await scene.step('without a recorded run, the window offers to record one', async () => {
    await ann.goto(scene.bench.address.href)
    await state(ann).getByText('Off').waitFor()
    await ann.keyboard.press('5')
    await ann.getByText('No recorded run.').waitFor()
    await scene.snapshot(ann, 'simulation-empty')
  })
  await scene.step('a recorded run is simulated bit for bit', async () => {
    await call({ call: 'home' })
    await state(ann).getByText('Running').waitFor()
    await ann.waitForFunction(async () => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: '{"call":"status"}' })
      return !(await response.json()).doing
    })
    assert.equal((await call({ call: 'record', name: 'sine' })).answer, 'done')
    await call({ call: 'move', reference: 'sine', values: { amplitude: 0.5, frequency: 1 } })
    await ann.waitForTimeout(1500)
    await call({ call: 'halt' })
    await call({ call: 'end_record' })
    await ann.getByText('None: identical bit for bit.').waitFor()
    await status.getByText(/× real time/).waitFor()
    await scene.snapshot(ann, 'simulation-same')
  })
  await scene.step('another gain changes the result while the slider moves; the previous gain restores it', async () => {
    const slider = ann.getByRole('slider', { name: /position_gain/ })
    await slider.fill('6')
    await ann.getByText('None: identical bit for bit.').waitFor({ state: 'detached' })
    assert.match(await torque.innerText(), /[1-9]/)
    const box = await slider.boundingBox()
    await ann.mouse.move(box.x + 0.3 * box.width, box.y + box.height / 2)
    await ann.mouse.down()
    for (let k = 0; k < 20; k++) await ann.mouse.move(box.x + (0.3 + 0.02 * k) * box.width, box.y + box.height / 2)
    await ann.mouse.up()
    await scene.snapshot(ann, 'simulation-other')
    await ann.getByRole('button', { name: 'Torque', exact: true }).click()
    await ann.getByRole('img', { name: /Simulated − recorded/ }).waitFor()
    await slider.fill('15')
    await ann.getByText('None: identical bit for bit.').waitFor()
  })
  await scene.step('all parameters can be changed, including the plant; exceptions are refused with a reason', async () => {
    const add = ann.getByRole('combobox', { name: 'Add a parameter' })
    await add.fill('plant.drive.load_inertia')
    const inertia = ann.getByRole('textbox', { name: /load inertia/ })
    await inertia.fill('0.01')
    await inertia.press('Enter')
    await ann.getByText('None: identical bit for bit.').waitFor({ state: 'detached' })
    assert.ok(await ann.getByRole('button', { name: /Apply to target/ }).isDisabled(), 'plant values cannot be applied')
    await ann.getByRole('button', { name: /Remove plant.drive.load_inertia/ }).click()
    await ann.getByText('None: identical bit for bit.').waitFor()
    await add.fill('bench.tick_rate')
    const rate = ann.getByRole('textbox', { name: /tick rate/ })
    await rate.fill('2000')
    await rate.press('Enter')
    await ann.getByText(/cycles of the record depend on it/).waitFor()
    await ann.getByRole('button', { name: /Remove bench.tick_rate/ }).click()
  })
  await scene.step('changed values are applied to the target, and undone', async () => {
    const gain = ann.getByRole('textbox', { name: /position gain/ })
    await gain.fill('12')
    await gain.press('Enter')
    await ann.getByRole('button', { name: /Apply to target/ }).click()
    await ann.getByText(/1 value active on the target since cycle/).waitFor()
    const items = (await call({ call: 'items' })).items
    assert.equal(items.find((item) => item.path === 'bench.controller.position_gain').value, 12)
    await ann.getByRole('button', { name: 'Undo' }).click()
    await ann.getByText('Previous values restored').waitFor()
  })
})
