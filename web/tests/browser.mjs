// The page in a browser, on the real program: the experiment from start to download, and what goes wrong on the way.
// STICKSLIP is the program (target/debug/stickslip), CHROMIUM the browser, SHOTS a folder for pictures.

import assert from 'node:assert/strict'
import { spawn } from 'node:child_process'
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs'
import { createRequire } from 'node:module'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { createInterface } from 'node:readline'
import { chromium } from 'playwright-core'

const program = process.env.STICKSLIP ?? join(import.meta.dirname, '../../target/debug/stickslip')
const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8')
const shots = process.env.SHOTS
const project = mkdtempSync(join(tmpdir(), 'stickslip-page-'))
if (shots) mkdirSync(shots, { recursive: true })

/** Serves the project: the printed address, and how to end it. */
async function serve(listen) {
  // A slow clock: what is tested is the page, on two cores that a browser needs as well.
  const told = ['serve', '--listen', listen, '--project', project, '--set', 'bench.tick_rate=1000', '--set', 'bench.safety.missed_ticks=500']
  const child = spawn(program, told, { stdio: ['ignore', 'pipe', 'inherit'] })
  const lines = createInterface({ input: child.stdout })
  const address = await new Promise((resolve, reject) => {
    lines.once('line', resolve)
    child.once('exit', (code) => reject(new Error(`the program ended with ${code}`)))
  })
  const ended = new Promise((resolve) => child.once('exit', resolve))
  return { address: new URL(address), stop: () => (child.kill('SIGINT'), ended) }
}

const complaints = []
const barriers = []
let expected = 0

async function page(browser, name, scheme = 'light', size = { width: 1440, height: 900 }) {
  const context = await browser.newContext({ viewport: size, colorScheme: scheme, reducedMotion: 'reduce' })
  await context.addInitScript((name) => localStorage.getItem('stickslip.name') ?? localStorage.setItem('stickslip.name', name), name)
  const page = await context.newPage()
  page.on('console', (message) => message.type() === 'error' && !expected && complaints.push(message.text()))
  page.on('pageerror', (error) => complaints.push(String(error)))
  page.setDefaultTimeout(60_000)
  return page
}

async function accessible(page, where) {
  // Injected past the policy that keeps foreign scripts out of the page.
  const session = await page.context().newCDPSession(page)
  await session.send('Runtime.evaluate', { expression: axe })
  const answer = await session.send('Runtime.evaluate', { expression: 'axe.run(document).then((r) => JSON.stringify(r.violations))', awaitPromise: true, returnByValue: true })
  const violations = JSON.parse(answer.result.value)
  const told = violations.map((one) => `${one.id}: ${one.nodes.slice(0, 3).map((node) => `${node.target} ${node.any[0]?.message ?? ''}`).join('; ')}`)
  barriers.push(...told.map((one) => `${where}: ${one}`))
}

/** Both themes, looked at by axe and, where asked, kept as pictures. */
async function seen(page, what) {
  for (const scheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme: scheme })
    await page.waitForTimeout(150)
    await accessible(page, `${what}, ${scheme}`)
    if (shots)
      for (const [width, height] of [[1440, 900], [1280, 800]]) {
        await page.setViewportSize({ width, height })
        await page.waitForTimeout(150)
        await page.screenshot({ path: join(shots, `${what}-${scheme}-${width}.png`) })
      }
  }
  await page.emulateMedia({ colorScheme: 'light' })
}

let done = 0
async function step(what, work) {
  const begun = Date.now()
  try {
    await work()
  } catch (error) {
    error.message = `${what}: ${error.message}`
    throw error
  }
  done += 1
  console.log(`ok ${what} (${((Date.now() - begun) / 1000).toFixed(1)} s)`)
}

let bench = await serve('127.0.0.1:0')
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync'],
})
try {
  const ann = await page(browser, 'Ann')
  const stranger = await page(browser, 'Stranger')
  const state = (page) => page.locator('header [role=status] b')
  const measure = () => ann.getByRole('button', { name: 'Measure R' })

  await step('without the token a text says which address to open', async () => {
    expected += 1
    const answer = await stranger.goto(bench.address.origin)
    assert.equal(answer.status(), 401)
    assert.match(await stranger.textContent('body'), /Open the address that the program printed/)
    await stranger.context().close()
    expected -= 1
  })
  await step('the printed address opens the page; no script sees the token; its headers are strict', async () => {
    await ann.goto(bench.address.href)
    await state(ann).getByText('Off').waitFor()
    assert.equal(new URL(ann.url()).search, '')
    assert.equal(await ann.evaluate(() => document.cookie), '')
    const headers = (await ann.reload()).headers()
    assert.match(headers['content-security-policy'], /default-src 'self'/)
    assert.match(headers['content-security-policy'], /frame-ancestors 'none'/)
    assert.doesNotMatch(headers['content-security-policy'], /unsafe/)
    assert.equal(headers['x-content-type-options'], 'nosniff')
    assert.equal(headers['referrer-policy'], 'no-referrer')
    await state(ann).getByText('Off').waitFor()
    await seen(ann, 'home-empty')
  })
  await step('a click on a part opens its parameters, and a value outside its range is refused with the range', async () => {
    await ann.getByRole('button', { name: /^Encoder/ }).press('Enter')
    await ann.getByRole('heading', { name: 'Encoder' }).waitFor()
    const field = ann.getByLabel(/counts per revolution/).first()
    await field.fill('-3')
    await field.press('Tab')
    await ann.getByText(/Outside/).waitFor()
    await accessible(ann, 'parameters')
    await ann.getByRole('button', { name: 'Close' }).click()
  })
  await step('the palette finds a parameter and a command, the keys are told', async () => {
    await ann.keyboard.press('Control+k')
    await ann.keyboard.type('stribeck velocity')
    await ann.getByRole('option', { name: /stribeck_velocity/ }).first().waitFor()
    await accessible(ann, 'palette')
    await ann.keyboard.press('Escape')
    await ann.keyboard.press('?')
    await ann.getByRole('dialog', { name: 'Keys' }).waitFor()
    await accessible(ann, 'keys')
    await ann.keyboard.press('Escape')
    assert.equal(await ann.getByRole('dialog').count(), 0)
  })
  await step('homing, and the same person in a second tab; another one looks', async () => {
    await ann.getByRole('main').getByRole('button', { name: 'Home axis' }).first().click()
    await ann.getByText('Homed', { exact: true }).waitFor()
    const again = await ann.context().newPage()
    await again.goto(bench.address.origin)
    await again.getByText('You operate').waitFor()
    await again.close()
    const bob = await page(browser, 'Bob')
    await bob.goto(bench.address.href)
    await bob.getByText('Ann operates').first().waitFor()
    assert.ok(await bob.getByRole('main').getByRole('button', { name: /Home axis again/ }).isDisabled())
    await seen(bob, 'home-viewer')
    await bob.getByRole('button', { name: 'Ask for control' }).click()
    await ann.getByText('Bob asks for control').waitFor()
    await ann.getByRole('button', { name: 'Hand over' }).click()
    await bob.getByText('You operate').waitFor()
    // Whoever looks may stop.
    await ann.keyboard.press('Escape')
    await ann.getByText('Confirmed').waitFor()
    await state(ann).getByText('Ready').waitFor()
    await bob.context().close()
    // Who has gone operates no more.
    await ann.getByText('Nobody operates').waitFor()
  })
  await step('a measurement is drawn while it runs, also after a reload', async () => {
    await ann.keyboard.press('2')
    await ann.getByText(/No measurement yet/).waitFor()
    await seen(ann, 'friction-empty')
    await ann.getByRole('button', { name: /Quick/ }).click()
    const field = (name) => ann.getByRole('textbox', { name })
    for (const [name, value] of [[/slowest/, '2'], [/fastest/, '40'], [/speeds/, '5']]) {
      await field(name).fill(value)
      await field(name).press('Enter')
    }
    await ann.getByText(/Friction at 5 speeds from 2 to 40/).waitFor()
    assert.equal(await field(/speeds/).inputValue(), '5')
    await seen(ann, 'friction-recipe')
    await ann.keyboard.press('Escape')
    await measure().click()
    await state(ann).getByText('Measuring').waitFor()
    await ann.getByRole('img', { name: /[1-9]\d* points/ }).first().waitFor()
    await ann.reload()
    await ann.getByRole('img', { name: /[1-9]\d* points/ }).first().waitFor()
    await seen(ann, 'friction-running')
  })
  await step('the numbers on the page are those of the fit', async () => {
    await ann.getByRole('button', { name: /Download to target/ }).waitFor()
    const shown = await ann.locator('aside tbody tr').first().innerText()
    const answer = await ann.evaluate(async () => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': 'Ann' }, body: '{"call":"curve"}' })
      return response.json()
    })
    const [breakaway] = answer.fit.parameters
    assert.ok(shown.includes(breakaway.value) && shown.includes(breakaway.half_width), `${shown} ${JSON.stringify(breakaway)}`)
    const folder = join(project, 'runs', `${String(answer.run).padStart(4, '0')}-measure-friction`)
    const summary = JSON.parse(readFileSync(join(folder, 'summary.json'), 'utf8'))
    assert.equal(answer.points.length, summary.results['measure.plateaus'].value)
    await seen(ann, 'friction-done')
    await ann.getByRole('button', { name: 'Show as table' }).click()
    assert.equal(await ann.getByRole('dialog').locator('tbody tr').count(), answer.points.length)
    await ann.getByRole('dialog').getByRole('button', { name: 'Close' }).click()
    await ann.getByRole('tab', { name: 'Over time' }).click()
    await ann.getByRole('img', { name: /Drive torque over time/ }).waitFor()
    await ann.getByRole('tab', { name: 'Over speed' }).click()
  })
  await step('a figure leaves as SVG, PNG and CSV', async () => {
    for (const kind of ['SVG', 'PNG', 'CSV']) {
      await ann.getByRole('button', { name: 'Export figure' }).click()
      const [download] = await Promise.all([ann.waitForEvent('download'), ann.getByRole('button', { name: kind, exact: true }).click()])
      const bytes = readFileSync(await download.path())
      assert.ok(bytes.length > 500, `${kind} has ${bytes.length} bytes`)
      if (kind === 'SVG') assert.match(bytes.toString(), /#195ad7/i)
    }
  })
  await step('the download shows the difference, comes into force and can be undone', async () => {
    await ann.getByRole('button', { name: /Download to target/ }).click()
    const dialog = ann.getByRole('dialog', { name: /Download own friction/ })
    await dialog.getByText(/more unchanged/).waitFor()
    assert.ok((await dialog.locator('tbody tr').count()) >= 1)
    await seen(ann, 'friction-download')
    await dialog.getByRole('button', { name: /^Download \d/ }).click()
    await ann.getByText(/in force since cycle/).waitFor()
    await ann.getByRole('button', { name: /Own friction is that of run/ }).waitFor()
    await seen(ann, 'friction-downloaded')
    await ann.getByRole('button', { name: 'Undo' }).click()
    await ann.getByRole('button', { name: /Download to target/ }).waitFor()
  })
  await step('a fault says what it was and what to do', async () => {
    await ann.evaluate(async () => {
      const call = (body) => fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': 'Ann' }, body: JSON.stringify(body) })
      await call({ call: 'move', reference: 'sine', values: { amplitude: 1, frequency: 1 } })
      await call({ call: 'inject', fault: 'encoder-stuck' })
    })
    await ann.getByRole('alert', { name: 'Fault' }).waitFor()
    await ann.keyboard.press('1')
    await ann.getByText('unknown').first().waitFor()
    await seen(ann, 'home-fault')
  })
  await step('without the program values grow old; it comes back and is found again', async () => {
    expected += 1
    await bench.stop()
    await state(ann).getByText('Offline').waitFor()
    await ann.getByText(/values are \d+\s*s old/).waitFor()
    await seen(ann, 'home-offline')
    bench = await serve(bench.address.host)
    await state(ann).getByText('Off', { exact: true }).waitFor()
    expected -= 1
  })
  assert.deepEqual(complaints, [], 'the console says nothing')
  assert.deepEqual(barriers, [], 'axe finds nothing')
  console.log(`${done} passed`)
} catch (error) {
  if (complaints.length) console.error(complaints.join('\n'))
  if (barriers.length) console.error([...new Set(barriers)].join('\n'))
  throw error
} finally {
  await browser.close()
  await bench.stop()
  rmSync(project, { recursive: true, force: true })
}
