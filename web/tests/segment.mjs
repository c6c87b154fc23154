// The bench on emulated servo drives: the page shows the devices of the segment, their states, frames and faults. It runs in
// a network namespace of its own, with a pair of virtual interfaces.

import assert from 'node:assert/strict'
import { execFileSync, spawn, spawnSync } from 'node:child_process'
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { caller, play } from './harness.mjs'

const INSIDE = 'STICKSLIP_IN_NAMESPACE'
const LINKS = 'ip link add ec0 type veth peer name ec1 && ip link set ec0 up && ip link set ec1 up && ip link set lo up'
const program = process.env.STICKSLIP ?? join(import.meta.dirname, '../../target/debug/stickslip')
// A loaded computer may be late: long watchdogs, missed set-points are not supervised.
const START = '{ index = 0x10F1, subindex = 2, value = 65535, bytes = 2 }'
// The drive motor starts with a fault (0x2020:1), which its first start resets.
const drives = (fault) => `watchdog = 2.0\n[motor]\nstart = [${START}${fault}]\n[load]\nstart = [${START}]\n[accelerometer]\nposition = 2\nvolts = 10.0\n`
const FAULT = ', { index = 0x2020, subindex = 1, value = 0x4210, bytes = 2 }'
const VALUES = [
  'bench.torque_amplifier=true', 'bench.tick_rate=1000', 'bench.safety.missed_ticks=500', 'bench.safety.speed=10000', 'bench.safety.following_error=10',
  'bench.controller.position_gain=8', 'bench.controller.velocity_gain=0.05', 'model.drive_lag=0.003', 'model.encoder.counts_per_revolution=65536', 'model.encoder.counter_range=4294967296',
]

/** Starts this test again in a namespace, or reports why it is not run. */
function enter() {
  const scan = spawnSync(program, ['ethercat', 'scan', 'lo'], { encoding: 'utf8' })
  if (/built without/.test(scan.stdout + scan.stderr)) return console.log('NOT RUN: the program was built without the EtherCAT main device')
  const options = ['-rn', '-n'].find((options) => spawnSync('unshare', [options, 'sh', '-c', LINKS]).status === 0)
  if (!options) return console.log('NOT RUN: this computer permits no network namespace with virtual interfaces, or iproute2 is missing')
  const line = `${LINKS} && exec ${process.execPath} ${import.meta.filename}`
  process.exitCode = spawnSync('unshare', [options, 'sh', '-c', line], { stdio: 'inherit', env: { ...process.env, [INSIDE]: '1' } }).status ?? 1
}

/** Plays with a bench on emulated drives. */
async function onDrives(fault, work) {
  const folder = mkdtempSync(join(tmpdir(), 'stickslip-drives-'))
  const file = join(folder, 'drives.toml')
  writeFileSync(file, drives(fault))
  const plant = spawn(program, ['plant', '--ethercat', 'ec0', '--analog', '1'], { stdio: ['ignore', 'pipe', 'inherit'] })
  try {
    await new Promise((resolve) => plant.stdout.once('data', resolve))
    await play(work, VALUES, ['--io', `ethercat:ec1,${file}`])
  } finally {
    plant.kill('SIGINT')
    rmSync(folder, { recursive: true, force: true })
  }
}

async function inside() {
  await onDrives(FAULT, async (scene) => {
    const page = await scene.page('Ann')
    const call = caller(page)
    const card = page.getByRole('region', { name: 'EtherCAT' })

    await scene.step('a drive with a fault at the start is shown with its code', async () => {
      await page.goto(scene.bench.address.href)
      await page.keyboard.press('7')
      await card.getByText('Fault of a device').waitFor()
      await card.getByText('error code 0x4210: drive too hot').waitFor()
      assert.match(await card.innerText(), /0 stickslip drive motor\s*drive motor\s+OP\s+fault\s+0x0218/)
      await card.scrollIntoViewIfNeeded()
      await scene.snapshot(page, 'segment-fault')
    })
    await scene.step('homing resets it; all devices are in OP and both drives enabled', async () => {
      await page.getByRole('main').getByRole('button', { name: 'Home axis' }).click()
      // A stall of this computer may end the motion with a fault; the drives have been enabled.
      await card.getByText('All devices in OP').waitFor()
      await page.waitForFunction(() => document.querySelector('[aria-label=EtherCAT]').innerText.match(/operation enabled/g)?.length === 2)
      const { segment } = await call({ call: 'status' })
      assert.equal(segment.expected, 7)
      assert.equal(segment.counter, 7)
      assert.deepEqual(segment.devices.map((device) => [device.role, device.al_state]), [['motor', 'OP'], ['load', 'OP'], ['accelerometer', 'OP']])
      assert.ok(segment.frames > 1000 && segment.last_second.rms > 0 && segment.last_second.rms < 0.5e-3, JSON.stringify(segment))
      await card.scrollIntoViewIfNeeded()
      await scene.snapshot(page, 'segment')
    })
    await scene.step('an interface that is switched off is a fault with lost frames', async () => {
      execFileSync('ip', ['link', 'set', 'ec0', 'down'])
      await page.getByRole('alert', { name: 'Fault' }).waitFor()
      const { state } = await call({ call: 'status' })
      if (state === 'ended') return console.log('NOT RUN: this computer is too busy for a bench at 1 kHz')
      await page.getByRole('alert', { name: 'Fault' }).getByText(/has not answered/).waitFor()
      for (let lost = 0; lost < 100; await page.waitForTimeout(100)) lost = (await call({ call: 'status' })).segment.lost
      assert.match(await card.innerText(), /Frames lost, with a wrong counter\s+[\d\s]{3,}, \d+/)
    })
  })
}

await (process.env[INSIDE] ? inside() : enter())
