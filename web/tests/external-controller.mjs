// An external controller on a running bench: its parameters, its selection, its reload.

import assert from 'node:assert/strict'
import { execFileSync } from 'node:child_process'
import { mkdtempSync, readFileSync, rmSync, unlinkSync, writeFileSync } from 'node:fs'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { downloadEntered, play, state } from './harness.mjs'

const root = join(import.meta.dirname, '../..')
const folder = mkdtempSync(join(tmpdir(), 'stickslip-loaded-'))
const library = join(folder, 'p_pi.so')
const source = readFileSync(join(root, 'examples/controller/p_pi.c'), 'utf8')
const header = join(root, 'crates/bench/src/external')

function compile(text) {
  const file = join(folder, 'p_pi.c')
  writeFileSync(file, text)
  execFileSync('cc', ['-O1', '-shared', '-fPIC', '-I', header, '-o', library, file])
}

compile(source)
// In the process of the bench, and with low gains for the low tick rate: a separate process would be late on a busy computer.
const soft = ['position_gain=6', 'velocity_gain=0.03', 'integral_time=0.2']
const options = ['--controller', library, '--trust', ...soft.flatMap((value) => ['--loaded-set', value])]

await play(
  async (scene) => {
    const page = await scene.page('Ann')
    await page.goto(scene.bench.address.href)
    const tile = page.getByRole('button', { name: 'P-PI cascade' })
    const panel = page.getByRole('complementary', { name: /^Parameters of P-PI/ })

    await scene.step('the external controller is active while the axis is homed', async () => {
      await tile.waitFor()
      assert.match(await tile.innerText(), /controller, active/)
      await page.getByRole('button', { name: 'Home axis' }).first().click()
      await page.getByText('Homed', { exact: true }).waitFor()
      await page.waitForFunction(() => /µs per call/.test(document.body.innerText))
    })

    await scene.step('its parameters have unit and range', async () => {
      await tile.click()
      await panel.getByRole('heading', { name: 'P-PI cascade (controller)' }).waitFor()
      const gain = panel.getByRole('textbox', { name: 'position gain' })
      assert.equal(await gain.inputValue(), '6')
      await gain.fill('7.5')
      await gain.press('Enter')
      await downloadEntered(page)
      await page.getByText(/1 value active on the target since cycle/).waitFor()
      await gain.fill('1000')
      await gain.press('Enter')
      await panel.getByText('Outside 0 … 500 1/s').waitFor()
      await scene.snapshot(page, 'loaded')
    })

    await scene.step('switching to the controller of the preset and back', async () => {
      const selector = panel.getByLabel('Position controller', { exact: true })
      await selector.selectOption('preset')
      await downloadEntered(page)
      await page.waitForFunction(() => /controller, not active/.test(document.body.innerText))
      await selector.selectOption('loaded')
      await downloadEntered(page)
      await page.waitForFunction(() => !/controller, not active/.test(document.body.innerText))
      assert.equal(await state(page).innerText(), 'Running')
    })

    await scene.step('after compilation the controller is reloaded', async () => {
      unlinkSync(library)
      compile(source.replace('"P-PI cascade"', '"P-PI, second"'))
      await panel.getByRole('button', { name: 'Reload' }).click()
      await page.getByText('The controller was reloaded and starts at rest').waitFor()
      await page.getByRole('button', { name: 'P-PI, second' }).waitFor()
      assert.equal(await page.getByRole('textbox', { name: 'position gain' }).inputValue(), '7.5', 'with the previous values')
    })
  },
  ['bench.tick_rate=1000', 'bench.safety.missed_ticks=500', 'bench.safety.following_error=50'],
  options,
)
rmSync(folder, { recursive: true })
