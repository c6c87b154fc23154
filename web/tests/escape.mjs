// Esc closes one menu, popup or dialog, or stops the axis; F8 and the button always stop it.

import assert from 'node:assert/strict'
import { caller, play, state } from './harness.mjs'

await play(async (scene) => {
  const ann = await scene.page('Ann')
  ann.setDefaultTimeout(15_000)
  const call = caller(ann)
  const running = async () => (await call({ call: 'status' })).state === 'running'
  const torqueOn = async () => {
    if (!(await running())) await call({ call: 'start' })
    await state(ann).getByText('Running').waitFor()
  }
  const button = (name) => ann.getByRole('button', { name })
  const dialog = (name) => ann.getByRole('dialog', { name })
  const open = (path) => ann.goto(scene.bench.address.origin + path)

  await scene.step('with the torque on, Esc closes one overlay at a time and the axis keeps running', async () => {
    await ann.goto(scene.bench.address.href)
    await call({ call: 'home' })
    await ann.getByText('Homed', { exact: true }).waitFor()
    await torqueOn()
    const pops = ann.locator('.pop')
    const overlays = [
      ['/', () => ann.keyboard.press('Control+k'), dialog('Find or run')],
      ['/', () => ann.keyboard.press('?'), dialog('Keys')],
      ['/', () => ann.keyboard.press('Shift+M'), dialog('Messages')],
      ['/', () => button(/^Encoder/).press('Enter'), ann.getByRole('complementary', { name: /Encoder/ })],
      ['/', () => button(/lost samples/).click(), ann.getByRole('group', { name: /not delivered/ })],
      ['/', () => ann.getByTitle('Change your name').click(), ann.getByLabel('Your name')],
      ['/design', () => button('Library').click(), pops],
      ['/design', () => button('Export figure').click(), pops],
      ['/controller', () => button('Export poles').click(), pops],
      ['/scope', () => button('Export from the scope').click(), ann.getByRole('group', { name: 'Export from the scope' })],
      ['/scope', () => button(/^Trigger/).click(), ann.getByRole('group', { name: 'Trigger' })],
    ]
    let at = ''
    for (const [path, show, overlay] of overlays) {
      if (path !== at) await open((at = path))
      await state(ann).getByText('Running').waitFor()
      await show()
      await overlay.waitFor()
      await ann.keyboard.press('Escape')
      await overlay.waitFor({ state: 'detached' })
      assert.ok(await running(), `Esc stopped the axis with an open overlay in ${path}`)
    }
    await open('/')
    await button(/^Encoder/).press('Enter')
    await ann.keyboard.press('Control+k')
    await ann.keyboard.press('Escape')
    await dialog('Find or run').waitFor({ state: 'detached' })
    assert.equal(await ann.getByRole('complementary', { name: /Encoder/ }).count(), 1, 'the topmost overlay closes alone')
    await ann.keyboard.press('Escape')
    await ann.getByRole('complementary', { name: /Encoder/ }).waitFor({ state: 'detached' })
    assert.ok(await running())
  })
  await scene.step('Esc cancels the drag of a handle and the axis keeps running', async () => {
    await open('/design')
    const handle = ann.getByRole('slider', { name: 'Breakaway torque', exact: true })
    await handle.waitFor()
    const before = await handle.getAttribute('aria-valuenow')
    const { x, y, width, height } = await handle.boundingBox()
    await ann.mouse.move(x + width / 2, y + height / 2)
    await ann.mouse.down()
    await ann.mouse.move(x + width / 2, y - 30, { steps: 4 })
    await ann.getByText(/was \d/).first().waitFor()
    await ann.keyboard.press('Escape')
    await ann.mouse.up()
    await ann.waitForFunction((before) => document.querySelector('[aria-label="Breakaway torque"]').getAttribute('aria-valuenow') === before, before)
    assert.ok(await running())
  })
  await scene.step('without an overlay Esc stops the axis, also from a text field; a key held down acts once', async () => {
    await open('/runs')
    await state(ann).getByText('Running').waitFor()
    await ann.getByRole('searchbox').first().fill('M_S')
    await ann.keyboard.press('Control+k')
    await ann.keyboard.down('Escape')
    await ann.keyboard.down('Escape')
    await ann.keyboard.up('Escape')
    await dialog('Find or run').waitFor({ state: 'detached' })
    assert.ok(await running())
    await ann.getByRole('searchbox').first().focus()
    await ann.keyboard.press('Escape')
    await ann.getByText('Confirmed').waitFor()
    await state(ann).getByText('Ready').waitFor()
    assert.equal(await ann.getByRole('searchbox').first().inputValue(), 'M_S')
  })
  await scene.step('F8 and the button stop the axis with a dialog open', async () => {
    for (const stop of [() => ann.keyboard.press('F8'), () => button(/^Stop/).click()]) {
      await torqueOn()
      await ann.keyboard.press('Control+k')
      await ann.keyboard.type('home')
      await stop()
      await state(ann).getByText('Ready').waitFor()
      await dialog('Find or run').waitFor()
      await ann.keyboard.press('Escape')
    }
  })
  await scene.step('without current values Esc sends Stop, and the result is shown', async () => {
    await scene.unreachable(async () => {
      await scene.bench.stop()
      await state(ann).getByText('Offline').waitFor()
      await ann.keyboard.press('Escape')
      await ann.getByText('Not confirmed, use the hardware stop').waitFor()
      await scene.serve(scene.bench.address.host)
    })
  })
})
