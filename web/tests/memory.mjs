// Nothing is lost by a fault, a restart or a killed program: records of measurements, the state of the target, captures.

import assert from 'node:assert/strict'
import { readFileSync, writeFileSync } from 'node:fs'
import { caller, play, state } from './harness.mjs'

const PLAN = { slowest: '20', fastest: '40', speeds: '8' }

await play(async (scene) => {
  const ann = await scene.page('Ann')
  // A device with little memory: the buffer of the scope is short.
  await ann.addInitScript(() => Object.defineProperty(Navigator.prototype, 'deviceMemory', { value: 0.03 }))
  let buffer
  const call = caller(ann)
  const alert = ann.getByRole('alert', { name: 'Fault' })
  const until = async (done) => {
    for (;;) {
      const answer = await done()
      if (answer) return answer
      await ann.waitForTimeout(50)
    }
  }
  const status = () => call({ call: 'status' })
  const idle = () => until(async () => !(await status()).doing)
  /** Injects a fault after some seconds. */
  const inject = async (fault, after) => {
    const { cycle, rate } = await status()
    const answer = await call({ call: 'inject', fault: `${fault}@${(cycle / rate + after).toFixed(3)}s` })
    assert.equal(answer.error, undefined)
  }

  await scene.step('a measurement is recorded, and a fault during it leaves an incomplete run with its cause', async () => {
    await ann.goto(scene.bench.address.href)
    await state(ann).getByText('Off', { exact: true }).waitFor()
    await inject('ticks-missed=700', 14)
    const started = await call({ call: 'measure', what: 'friction', plan: PLAN })
    assert.equal(started.error, undefined)
    await ann.getByRole('banner').getByText('recording', { exact: true }).waitFor()
    await alert.getByText(/missed 7\d\d ticks in a row/).waitFor()
    await alert.getByText('Close other programs, and run stickslip doctor.').waitFor()
    await idle()
    await scene.snapshot(ann, 'fault-timing')
    await ann.goto(`${scene.bench.address.origin}/runs`)
    const row = ann.getByRole('row').filter({ hasText: 'sweep' })
    await row.getByText('incomplete').waitFor()
    await ann.getByText(/are recorded: [12] files?, \d+ of 2000 MB\. The oldest are removed first; results and renamed runs stay\./).waitFor()
    await row.getByRole('link').click()
    const run = ann.getByRole('complementary', { name: 'Run' })
    await run.getByText(/^Incomplete\. .*missed 7\d\d ticks/).waitFor()
    await run.getByRole('link', { name: 'run.mf4' }).waitFor()
    await scene.snapshot(ann, 'runs-incomplete')
  })
  await scene.step('the remedy in the banner fits the fault, and its button makes the axis usable again', async () => {
    await alert.getByRole('button', { name: 'Cycle time' }).click()
    await ann.waitForURL('**/implementation')
    await alert.getByRole('button', { name: 'Home axis again' }).click()
    await until(async () => (await status()).state === 'running')
    await idle()
    await call({ call: 'move', reference: 'sine', values: { amplitude: 1, frequency: 1 } })
    await inject('controller-nan', 0.5)
    await alert.getByText(/not finite/).waitFor()
    assert.equal(await alert.getByRole('button', { name: /Home/ }).count(), 0, 'the zero is still valid')
    await scene.snapshot(ann, 'fault-controller')
    await alert.getByRole('button', { name: 'Acknowledge and arm' }).click()
    await state(ann).getByText('Ready', { exact: true }).waitFor()
  })
  await scene.step('after the program was killed, the state of the target is offered with its differences', async () => {
    const values = { 'bench.controller.position_gain': '11.5', 'bench.desired.breakaway_torque': '0.35' }
    const set = await call({ call: 'set', values })
    assert.equal(set.error, undefined)
    const gain = async () => (await call({ call: 'items' })).items.find((item) => item.path === 'bench.controller.position_gain').value
    await scene.unreachable(async () => {
      await scene.bench.kill()
      await state(ann).getByText('Offline', { exact: true }).waitFor()
      await scene.serve(scene.bench.address.host)
      await state(ann).getByText('Off', { exact: true }).waitFor()
    })
    const notice = ann.getByRole('region', { name: 'Earlier state' })
    await notice.getByText('Before, 2 values were different.').waitFor()
    assert.notEqual(await gain(), 11.5, 'nothing changes by itself')
    await scene.snapshot(ann, 'earlier-notice')
    await notice.getByRole('button', { name: 'Show…' }).click()
    const dialog = ann.getByRole('dialog', { name: 'State before the restart' })
    await dialog.getByRole('row', { name: 'bench.desired.breakaway_torque' }).getByText('0.35 N·m').waitFor()
    await scene.snapshot(ann, 'earlier-dialog')
    await dialog.getByRole('button', { name: 'Restore 2 values' }).click()
    await dialog.waitFor({ state: 'detached' })
    await notice.waitFor({ state: 'detached' })
    assert.equal(await gain(), 11.5)
    // The run that was interrupted before is still there.
    const { runs } = await call({ call: 'runs' })
    assert.ok(runs.some((run) => run.incomplete?.includes('ticks')), JSON.stringify(runs.map((run) => run.incomplete)))
  })
  const dock = ann.getByRole('region', { name: 'Scope', exact: true })
  const button = (name) => dock.getByRole('button', { name, exact: true })
  const head = () => dock.locator('header').first().innerText()
  const rows = async (kind) => {
    await button('Export from the scope').click()
    const [download] = await Promise.all([ann.waitForEvent('download'), dock.getByRole('button', { name: kind, exact: true }).click()])
    return readFileSync(await download.path())
  }
  const moving = async () => {
    if (!(await status()).doing) await call({ call: 'move', reference: 'sine', values: { amplitude: 2, frequency: 1 } })
  }
  await scene.step('hold freezes the data until it is released, and cursors stay', async () => {
    await ann.goto(`${scene.bench.address.origin}/scope`)
    await ann.evaluate(() => localStorage.removeItem('stickslip.dock'))
    await call({ call: 'home' })
    await idle()
    await moving()
    await ann.waitForTimeout(3000)
    await dock.hover()
    await ann.keyboard.press('Space')
    await button('Resume Space').waitFor()
    await ann.keyboard.press('a')
    const csv = async () => (await rows('CSV of all data')).toString()
    const cursor = () => dock.getByRole('slider', { name: 'Cursor A' }).getAttribute('aria-valuetext')
    const [before, a] = [await csv(), await cursor()]
    assert.ok(before.length > 100_000, String(before.length))
    buffer = Number(/ s of ([\d.]+)/.exec(await head())[1])
    assert.ok(buffer < 20, `${buffer} s`)
    // Longer than the buffer.
    await ann.waitForTimeout(1000 * buffer + 2000)
    assert.equal(await csv(), before, 'the same samples')
    assert.equal(await cursor(), a)
    await scene.snapshot(ann, 'scope-held')
  })
  await scene.step('the history of the program reaches further back than the buffer, with its resolution', async () => {
    await ann.keyboard.press('Space')
    await button('Hold Space').waitFor()
    await ann.waitForTimeout(1500)
    // At 1 kHz, 16 cycles are 16 ms.
    const reach = dock.getByRole('button', { name: /(\d+ s|\d+ min) in steps of 16 ms/ })
    await reach.waitFor()
    await reach.click()
    await button('Resume Space').waitFor()
    const span = async () => Number((/([\d.]+) s of/.exec(await head()) ?? [])[1])
    await until(async () => (await span()) > buffer + 5)
    // The picture of the oldest part is not empty: a pixel of the trace in the first tenth.
    const drawn = () =>
      dock.getByRole('region', { name: /^Pane: angle/ }).locator('canvas.dense').evaluate((canvas) => {
        const { width, height } = canvas
        const data = canvas.getContext('2d').getImageData(Math.round(width * 0.3), 0, Math.round(width * 0.1), height).data
        return data.some((value, at) => at % 4 === 3 && value > 0)
      })
    await until(drawn)
    await scene.snapshot(ann, 'scope-history')
    await ann.keyboard.press('Space')
  })
  await scene.step('a single shot is saved as a capture, and shown again after a reload and a restart', async () => {
    await ann.waitForTimeout(300)
    await dock.hover()
    for (let i = 0; i < 14; i++) await ann.mouse.wheel(0, -200)
    await dock.getByRole('button', { name: /^Trigger:/ }).click()
    await dock.getByRole('combobox', { name: 'Signal' }).selectOption('setpoint.velocity')
    await dock.getByLabel('Level').fill('3')
    await dock.getByLabel('Level').press('Tab')
    await button('Single').click()
    await until(async () => (await moving(), (await call({ call: 'runs', query: 'kind:capture single' })).of > 0))
    await button('Off').click()
    await dock.getByRole('button', { name: /^Trigger:/ }).click()
    await scene.unreachable(async () => {
      await scene.bench.kill()
      await state(ann).getByText('Offline', { exact: true }).waitFor()
      await scene.serve(scene.bench.address.host)
      await state(ann).getByText('Off', { exact: true }).waitFor()
    })
    await ann.reload()
    await button('Captures').first().click()
    const shot = dock.getByRole('button', { name: /single shot, setpoint\.velocity rises through 3/ })
    await shot.click()
    await until(async () => /single shot/.test(await head()))
    await button('Resume Space').waitFor()
    const lines = (await rows('CSV of all data')).toString().trim().split('\n')
    const column = lines[0].split(',').indexOf('setpoint.velocity [rad/s]')
    const values = lines.slice(1).map((line) => Number(line.split(',')[column]))
    const at = values.findIndex((value, i) => i > 0 && value >= 3 && values[i - 1] < 3)
    assert.ok(at > 0, 'the sample at the event has passed the level, the one before has not')
    await scene.snapshot(ann, 'scope-capture')
    await ann.keyboard.press('Space')
    await until(async () => !/single shot/.test(await head()))
  })
  await scene.step('the last 2 s before a fault are one click away, also after a reload', async () => {
    await call({ call: 'home' })
    await idle()
    await call({ call: 'move', reference: 'sine', values: { amplitude: 1, frequency: 1 } })
    await ann.waitForTimeout(3000)
    await inject('controller-nan', 0.3)
    await until(async () => (await status()).fault?.capture != null)
    await ann.goto(`${scene.bench.address.origin}/friction`)
    await alert.getByRole('button', { name: 'Last 2 s in the scope' }).click()
    await until(async () => /fault, output not finite/.test(await head()))
    const { fault } = await status()
    const lines = (await rows('CSV of the visible range')).toString().trim().split('\n').slice(1)
    const cycles = lines.map((line) => Number(line.split(',')[0]))
    assert.ok(cycles[0] <= fault.cycle - 1999 && cycles.at(-1) >= fault.cycle + 499, `${cycles[0]} … ${cycles.at(-1)}, fault ${fault.cycle}`)
    await scene.snapshot(ann, 'fault-scope')
  })
  await scene.step('the scope leaves as MDF 4, Parquet and MAT, written by the program', async () => {
    const kinds = { mf4: 'MDF 4', parquet: 'Parquet', mat: 'MAT' }
    for (const [kind, name] of Object.entries(kinds)) {
      const bytes = await rows(`${name} of the visible range`)
      assert.equal(bytes.subarray(0, { mf4: 3, parquet: 4, mat: 6 }[kind]).toString(), { mf4: 'MDF', parquet: 'PAR1', mat: 'MATLAB' }[kind])
      if (process.env.FILES) writeFileSync(`${process.env.FILES}/scope.${kind}`, bytes)
    }
    if (process.env.FILES) writeFileSync(`${process.env.FILES}/scope.csv`, await rows('CSV of the visible range'))
  })
})
