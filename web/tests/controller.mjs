// Controller Design: a gain, poles by hand, the same numbers as the command line, automatic tuning, the download.

import assert from 'node:assert/strict'
import { execFileSync } from 'node:child_process'
import { readFileSync } from 'node:fs'
import { join } from 'node:path'
import { play } from './harness.mjs'

const program = process.env.STICKSLIP ?? join(import.meta.dirname, '../../target/debug/stickslip')
const SLOW = ['bench.tick_rate=1000', 'bench.safety.missed_ticks=500']
const GAIN = 'bench.controller.velocity_gain'

await play(async (scene) => {
  const ann = await scene.page('Ann')
  ann.setDefaultTimeout(15_000)
  const main = ann.getByRole('main')
  const region = (name) => main.getByRole('region', { name, exact: true })
  const field = (name) => region('Gains').getByRole('textbox', { name })
  const call = (body) =>
    ann.evaluate(async (body) => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': 'Ann' }, body })
      return response.json()
    }, JSON.stringify(body))
  const value = async (path) => (await call({ call: 'items' })).items.find((item) => item.path === path)
  const settled = () => main.getByText('on the identified model', { exact: true }).waitFor()
  const checked = () => region('Robustness').locator('.notice').waitFor()
  const download = async () => {
    await ann.getByRole('button', { name: /^Download \d+ change/ }).click()
    const dialog = ann.getByRole('dialog', { name: /Download controller/ })
    await dialog.getByText(/\d unchanged/).waitFor()
    return dialog
  }

  await scene.step('the window shows the controller on the target: both loads, poles, open loop, step responses and hunting', async () => {
    await ann.goto(scene.bench.address.href)
    await ann.keyboard.press('4')
    await settled()
    await checked()
    await region('Hunting').getByText(/hunting predicted|It comes to rest/i).waitFor()
    for (const name of ['Poles', 'Open loop', 'Step responses']) await region(name).getByRole('img').first().waitFor()
    await main.getByText('The target has these values').waitFor()
    await scene.snapshot(ann, 'controller')
  })
  await scene.step('after a change of a gain, the page shows the same numbers as the command line', async () => {
    await field(/velocity gain/).fill('0.05')
    await field(/velocity gain/).press('Enter')
    await ann.getByRole('button', { name: /^Download 1 change/ }).waitFor()
    await settled()
    const out = join(scene.project, 'loop')
    execFileSync(program, ['loop', '--out', out, ...[...SLOW, `${GAIN}=0.05`].flatMap((one) => ['--set', one])])
    const { results } = JSON.parse(readFileSync(join(out, 'summary.json'), 'utf8'))
    for (const key of ['sensitivity_peak', 'gain_margin', 'phase_margin', 'crossover', 'bandwidth', 'noise_torque']) {
      const cells = await region('Key figures').locator(`tr[data-key=${key}] td`).allInnerTexts()
      for (const [index, load] of ['sliding', 'stuck'].entries()) {
        const expected = results[`loop.${load}.${key}`].value ?? Infinity
        const shown = cells[index].split('\n')[0]
        if (Number.isFinite(expected)) assert.ok(Math.abs(Number(shown) - expected) <= 6e-3 * Math.abs(expected), `${load} ${key}: ${shown} and ${expected}`)
        else assert.equal(shown, 'infinite')
      }
    }
    const before = (await value(GAIN)).value
    assert.notEqual(before, 0.05, 'a draft is not on the target')
    await scene.snapshot(ann, 'controller-draft')
    await field(/velocity gain/).fill('-1')
    await field(/velocity gain/).press('Enter')
    await region('Gains').getByText(/Outside/).waitFor()
  })
  await scene.step('Nyquist and load torque by keyboard; exported figures have units', async () => {
    await region('Open loop').getByRole('tab', { name: 'Bode' }).focus()
    await ann.keyboard.press('ArrowRight')
    await region('Open loop').getByRole('img', { name: /complex plane/ }).waitFor()
    await region('Step responses').getByRole('tab', { name: 'Load torque' }).click()
    await region('Step responses').getByText(/peak sliding −[\d.]+ mrad/).waitFor()
    await region('Step responses').getByRole('button', { name: /^Export/ }).click()
    const [file] = await Promise.all([ann.waitForEvent('download'), ann.getByRole('button', { name: 'CSV', exact: true }).click()])
    assert.match(readFileSync(await file.path(), 'utf8'), /mrad/)
  })
  await scene.step('automatic tuning runs next to the bench; its result is a draft with undo', async () => {
    await ann.getByRole('button', { name: /^Automatic/ }).click()
    await region('Robustness').getByText(/Automatic tuning: Tuned within/).waitFor({ timeout: 60_000 })
    await region('Robustness').getByText('Meets all robustness limits: sliding, stuck and in all corners.').waitFor()
    await ann.getByRole('button', { name: 'Undo', exact: true }).click()
    await settled()
    assert.equal(await field(/velocity gain/).inputValue(), '0.05')
    await ann.getByRole('button', { name: 'Redo', exact: true }).click()
    await settled()
  })
  await scene.step('the download lists the changes and applies them to the target', async () => {
    const gain = await field(/velocity gain/).inputValue()
    const dialog = await download()
    assert.ok((await dialog.locator('tbody tr').count()) >= 2)
    await scene.snapshot(ann, 'controller-download')
    await dialog.getByRole('button', { name: /^Download \d/ }).click()
    await ann.getByText(/Controller active on the target since cycle/).waitFor()
    await main.getByText('The target has these values').waitFor()
    assert.ok(Math.abs((await value(GAIN)).value - Number(gain)) < 1e-3 * Number(gain))
  })
  await scene.step('the poles of a state feedback are dragged by mouse and by keyboard', async () => {
    await region('Gains').getByLabel('kind', { exact: true }).first().selectOption('state-feedback')
    await field(/integral time/).waitFor()
    await region('Gains').getByLabel('kind', { exact: true }).nth(1).selectOption('poles')
    const grip = ann.getByRole('slider', { name: 'Desired poles' })
    await grip.waitFor()
    const before = Number(await grip.getAttribute('aria-valuenow'))
    const { x, y, width, height } = await grip.boundingBox()
    await ann.mouse.move(x + width / 2, y + height / 2)
    await ann.mouse.down()
    await ann.mouse.move(x - 25, y - 40, { steps: 6 })
    await ann.mouse.up()
    await settled()
    const after = Number(await grip.getAttribute('aria-valuenow'))
    assert.ok(after > 1.2 * before, `${before} → ${after}`)
    assert.ok(Math.abs(Number(await field(/bandwidth/).inputValue()) - after) < 1e-3 * after)
    await grip.focus()
    await ann.keyboard.press('ArrowUp')
    await ann.waitForFunction((after) => Number(document.querySelector('[aria-label="Desired poles"]').getAttribute('aria-valuenow')) > after, after)
    await settled()
    await scene.snapshot(ann, 'controller-poles')
    assert.equal((await value('bench.controller.kind')).choice, 'cascade')
  })
  await scene.step('a viewer has separate drafts and cannot download', async () => {
    const tom = await scene.page('Tom')
    await tom.goto(scene.bench.address.href)
    await tom.goto(new URL('/controller', scene.bench.address).href)
    const gain = tom.getByRole('textbox', { name: /velocity gain/ })
    await gain.fill('0.03')
    await gain.press('Enter')
    const off = tom.getByRole('button', { name: 'Ann has control' }).last()
    await off.waitFor()
    assert.ok(await off.isDisabled())
    await tom.context().close()
  })
  await scene.step('without the program the plots stay and editing is disabled', async () => {
    await scene.unreachable(async () => {
      await scene.bench.stop()
      await main.getByText(/Not connected/).first().waitFor()
      assert.ok(await field(/bandwidth/).isDisabled())
      await scene.snapshot(ann, 'controller-offline')
      await scene.serve(scene.bench.address.host)
      await settled()
      await ann.getByRole('button', { name: /^Download \d+ change/ }).waitFor()
    })
  })
})
