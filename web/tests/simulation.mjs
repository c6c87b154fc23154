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

  await scene.step('without a recorded run it says what is missing', async () => {
    await ann.goto(scene.bench.address.href)
    await state(ann).getByText('Off').waitFor()
    await ann.keyboard.press('5')
    await ann.getByText('No recorded run yet.').waitFor()
    await scene.seen(ann, 'simulation-empty')
  })
  await scene.step('a recorded run is simulated to the bit', async () => {
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
    await ann.getByText('None: every bit is as recorded.').waitFor()
    await status.getByText(/× real time/).waitFor()
    await scene.seen(ann, 'simulation-same')
  })
  await scene.step('another gain gives another course while the slider is moved, and the old one back', async () => {
    const slider = ann.getByRole('slider', { name: /position_gain/ })
    await slider.fill('6')
    await ann.getByText('None: every bit is as recorded.').waitFor({ state: 'detached' })
    assert.match(await torque.innerText(), /[1-9]/)
    const box = await slider.boundingBox()
    await ann.mouse.move(box.x + 0.3 * box.width, box.y + box.height / 2)
    await ann.mouse.down()
    for (let k = 0; k < 20; k++) await ann.mouse.move(box.x + (0.3 + 0.02 * k) * box.width, box.y + box.height / 2)
    await ann.mouse.up()
    await scene.seen(ann, 'simulation-other')
    await ann.getByRole('button', { name: 'Torque', exact: true }).click()
    await ann.getByRole('img', { name: /Simulated less recorded/ }).waitFor()
    await slider.fill('15')
    await ann.getByText('None: every bit is as recorded.').waitFor()
  })
  await scene.step('any parameter can be another, the machine as well; what cannot is refused in words', async () => {
    const add = ann.getByRole('combobox', { name: 'Add a parameter' })
    await add.fill('plant.drive.load_inertia')
    const inertia = ann.getByRole('textbox', { name: /load inertia/ })
    await inertia.fill('0.01')
    await inertia.press('Enter')
    await ann.getByText('None: every bit is as recorded.').waitFor({ state: 'detached' })
    assert.ok(await ann.getByRole('button', { name: /Take over/ }).isDisabled(), 'the machine is not taken over')
    await ann.getByRole('button', { name: /Take plant.drive.load_inertia away/ }).click()
    await ann.getByText('None: every bit is as recorded.').waitFor()
    await add.fill('bench.tick_rate')
    const rate = ann.getByRole('textbox', { name: /tick rate/ })
    await rate.fill('2000')
    await rate.press('Enter')
    await ann.getByText(/cycles of the record are counted by it/).waitFor()
    await ann.getByRole('button', { name: /Take bench.tick_rate away/ }).click()
  })
  await scene.step('what was found is taken over to the bench, and back', async () => {
    const gain = ann.getByRole('textbox', { name: /position gain/ })
    await gain.fill('12')
    await gain.press('Enter')
    await ann.getByRole('button', { name: /Take over/ }).click()
    await ann.getByText(/1 value in force since cycle/).waitFor()
    const items = (await call({ call: 'items' })).items
    assert.equal(items.find((item) => item.path === 'bench.controller.position_gain').value, 12)
    await ann.getByRole('button', { name: 'Undo' }).click()
    await ann.getByText('The values before are in force again').waitFor()
  })
})
