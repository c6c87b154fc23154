// The implementation on the target: blocks with live values, cycle times, code.

import assert from 'node:assert/strict'
import { caller, downloadEntered, play, state } from './harness.mjs'

await play(async (scene) => {
  const ann = await scene.page('Ann')
  const main = ann.getByRole('main')
  const call = caller(ann)
  const block = (name) => main.getByRole('button', { name })
  const value = (name) => main.getByRole('button', { name })

  await scene.step('the window shows the active blocks, with a value on each wire', async () => {
    await ann.goto(scene.bench.address.href)
    await state(ann).getByText('Off').waitFor()
    await ann.keyboard.press('7')
    await block(/^Position control cascade/).waitFor()
    const { wires } = await call({ call: 'flow' })
    const labels = wires.filter((wire) => wire.label)
    assert.equal(await main.locator('.stage .value').count(), labels.length)
    await ann.waitForFunction(() => [...document.querySelectorAll('.stage .value .number')].every((one) => one.textContent !== '–'))
    await main.getByText('No deadline missed').or(main.getByText(/deadlines? missed/)).first().waitFor()
    // Only a machine on a fieldbus has it.
    assert.equal(await main.getByRole('region', { name: 'EtherCAT' }).count(), 0)
    await scene.snapshot(ann, 'implementation')
    for (const [width, height] of [[1280, 720], [1920, 1080]]) {
      await ann.setViewportSize({ width, height })
      const wide = await ann.evaluate(() => document.documentElement.scrollWidth - innerWidth)
      assert.ok(wide <= 0, `no horizontal overflow at ${width}`)
      if (process.env.SHOTS) await ann.screenshot({ path: `${process.env.SHOTS}/implementation-${width}x${height}.png` })
    }
    await ann.setViewportSize({ width: 1440, height: 900 })
  })
  await scene.step('the values are live and keep their widths', async () => {
    await main.getByRole('button', { name: 'Home axis' }).click()
    await state(ann).getByText('Running').waitFor()
    await ann.waitForFunction(async () => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: '{"call":"status"}' })
      return !(await response.json()).doing
    })
    await call({ call: 'move', reference: 'sine', values: { amplitude: 0.5, frequency: 1 } })
    const angle = value(/^measured angle/)
    const texts = new Set()
    const widths = new Set()
    for (let k = 0; k < 20; k++) {
      texts.add(await angle.innerText())
      widths.add(Math.round((await angle.boundingBox()).width))
      await ann.waitForTimeout(60)
    }
    assert.ok(texts.size > 3, `${[...texts]}`)
    assert.equal(widths.size, 1, `${[...widths]}`)
    await call({ call: 'halt' })
  })
  await scene.step('a block lists its parameters; a downloaded value is active and the block is marked', async () => {
    await block(/^Position control/).click()
    const gain = main.getByRole('textbox', { name: /position gain/ })
    await gain.fill('12')
    await gain.press('Enter')
    await downloadEntered(ann)
    await block(/^Position control cascade 1 changed/).waitFor()
    const { items } = await call({ call: 'items' })
    assert.equal(items.find((item) => item.path === 'bench.controller.position_gain').value, 12)
    await main.getByText('Lines of C').waitFor()
    await main.locator('summary', { hasText: /^Code$/ }).click()
    await scene.snapshot(ann, 'implementation-block')
  })
  await scene.step('a block opens into the generated diagram and back, by mouse and by keyboard', async () => {
    await block(/^Velocity observer/).dblclick()
    await main.getByRole('navigation').getByText('Velocity observer').waitFor()
    await main.locator('.picture svg').waitFor()
    await scene.snapshot(ann, 'implementation-page')
    await ann.keyboard.press('Backspace')
    await block(/^Rendering law/).waitFor()
    await block(/^Drive output/).focus()
    await ann.keyboard.press('Enter')
    const inside = main.locator('.picture a').first()
    await inside.focus()
    await ann.keyboard.press('Enter')
    assert.equal(await main.getByRole('navigation').getByRole('button').count(), 3)
    await ann.goBack()
    assert.equal(await main.getByRole('navigation').getByRole('button').count(), 2)
    await ann.goBack()
    await block(/^Rendering law/).waitFor()
  })
  await scene.step('another law is another block', async () => {
    const { answer } = await call({ call: 'set', values: { 'bench.law.kind': 'smooth' } })
    assert.equal(answer, 'entered')
    await block(/^Rendering law smooth/).waitFor()
  })
  await scene.step('a signal of a wire is added to the scope', async () => {
    await value(/^servo voltage/).focus()
    await ann.keyboard.press('Enter')
    const panes = ann.getByRole('region', { name: 'Scope' })
    await panes.getByRole('button', { name: /servo voltage/ }).first().waitFor()
    await value(/^measurement tacho voltage/).dragTo(panes.locator('section').last())
    await panes.getByRole('button', { name: /measurement tacho voltage/ }).first().waitFor()
    await ann.keyboard.press('s')
  })
  await scene.step('the code is compiled with the active parameters and reproduces the model bit for bit', async () => {
    await main.getByRole('button', { name: /^Build/ }).click()
    await main.getByText(/^Compiled/).waitFor()
    await main.getByText('Build log').click()
    await main.getByText(/tick_selftest\.c/).first().waitFor()
    await scene.snapshot(ann, 'implementation-built')
  })
  await scene.step('downloaded files contain the active parameters and require the token', async () => {
    const { files } = await call({ call: 'target' })
    for (const { file } of files) {
      const coming = ann.waitForEvent('download')
      await main.locator(`a[href="/implementation/${file}"]`).click()
      assert.equal((await coming).suggestedFilename(), file.split('/').at(-1))
    }
    const text = await ann.evaluate(async () => (await fetch('/implementation/tick.c')).text())
    assert.match(text, /position_gain = 12\.0;/)
    const stranger = await fetch(new URL('/implementation/tick.c', scene.bench.address.origin))
    assert.equal(stranger.status, 401)
  })
})
