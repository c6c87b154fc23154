// The program, a browser and common functions for the tests of the page. STICKSLIP is the program (target/debug/stickslip),
// CHROMIUM the browser, SHOTS a folder for pictures, PAGE a folder of `npm run build` (dist) in place of the embedded page.

import assert from 'node:assert/strict'
import { spawn } from 'node:child_process'
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs'
import { createRequire } from 'node:module'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { createInterface } from 'node:readline'
import { chromium } from 'playwright-core'

const program = process.env.STICKSLIP ?? join(import.meta.dirname, '../../target/debug/stickslip')
const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8')
const shots = process.env.SHOTS
const built = process.env.PAGE
// A low tick rate: the tests check the page, on two processors that a browser also needs.
const SLOW = ['bench.tick_rate=1000', 'bench.safety.missed_ticks=500']

/** The state of the bench in the top bar. */
export const state = (page) => page.locator('header [role=status] b')

/** Answers requests for the page from the folder `built`, with the headers of the program. */
async function replacePage(context) {
  await context.route('**/*', async (route) => {
    const file = join(built, new URL(route.request().url()).pathname)
    if (/\.\w+$/.test(file) && existsSync(file)) return route.fulfill({ path: file })
    if (route.request().resourceType() !== 'document') return route.fallback()
    const response = await route.fetch({ maxRedirects: 0 })
    // The redirection after the token is not followed, because it would bypass this route: the address keeps its token.
    const page = response.status() === 200 || response.headers().location
    return page ? route.fulfill({ response, status: 200, contentType: 'text/html', path: join(built, 'index.html') }) : route.fulfill({ response })
  })
}

/** Calls the program as this user, from the page. */
export const caller = (page, user = 'Ann') => (body) =>
  page.evaluate(
    async ([user, body]) => {
      const response = await fetch('/api', { method: 'POST', headers: { 'Content-Type': 'application/json', 'Stickslip-Client': user }, body })
      return response.json()
    },
    [user, JSON.stringify(body)],
  )

/** Downloads the entered values by bar and dialog. */
export async function downloadEntered(page) {
  await page.getByRole('status', { name: 'Entered values' }).getByRole('button', { name: /^Download \d+ change/ }).click()
  await confirmDownload(page)
}

/** Confirms the open download dialog. */
export const confirmDownload = (page) => page.getByRole('dialog', { name: /^Download/ }).getByRole('button', { name: /^Download \d+ change/ }).click()

class Scene {
  project = mkdtempSync(join(tmpdir(), 'stickslip-page-'))
  complaints = []
  barriers = []
  messages = []
  done = 0
  #expected = 0

  constructor(values, options) {
    this.values = values
    this.options = options
  }

  /** Serves the project; sets the address and how to stop the program. */
  async serve(listen = '127.0.0.1:0') {
    const args = ['serve', '--listen', listen, '--project', this.project, ...this.options, ...this.values.flatMap((value) => ['--set', value])]
    const child = spawn(program, args, { stdio: ['ignore', 'pipe', 'inherit'] })
    const lines = createInterface({ input: child.stdout })
    const address = await new Promise((resolve, reject) => {
      lines.once('line', resolve)
      child.once('exit', (code) => reject(new Error(`the program ended with ${code}`)))
    })
    const ended = new Promise((resolve) => child.once('exit', resolve))
    this.bench = { address: new URL(address), ended, stop: () => (child.kill('SIGINT'), ended), kill: () => (child.kill('SIGKILL'), ended) }
  }

  async page(name, { width = 1440, height = 900, ...more } = {}) {
    const context = await this.browser.newContext({ viewport: { width, height }, colorScheme: 'light', reducedMotion: 'reduce', ...more })
    if (built) await replacePage(context)
    // Logs the messages of the page, including closed ones.
    await context.addInitScript(() =>
      new MutationObserver((changes) => {
        for (const { addedNodes } of changes) for (const node of addedNodes) if (node.closest?.('ol[aria-label=Messages] li')) console.debug(node.innerText)
      }).observe(document, { childList: true, subtree: true }),
    )
    await context.addInitScript((name) => localStorage.getItem('stickslip.name') ?? localStorage.setItem('stickslip.name', name), name)
    const page = await context.newPage()
    page.on('console', (message) => message.type() === 'debug' && this.messages.push(message.text().replace(/\s+/g, ' ')))
    page.on('console', (message) => message.type() === 'error' && !this.#expected && this.complaints.push(message.text()))
    page.on('pageerror', (error) => this.complaints.push(String(error)))
    page.setDefaultTimeout(60_000)
    return page
  }

  /** Console errors during `work` are expected. */
  async unreachable(work) {
    this.#expected += 1
    await work()
    this.#expected -= 1
  }

  async accessible(page, where) {
    // Injected past the policy that blocks external scripts on the page.
    const session = await page.context().newCDPSession(page)
    const { result } = await session.send('Runtime.evaluate', { expression: 'typeof axe' })
    if (result.value === 'undefined') await session.send('Runtime.evaluate', { expression: axe })
    const answer = await session.send('Runtime.evaluate', { expression: 'axe.run(document).then((r) => JSON.stringify(r.violations))', awaitPromise: true, returnByValue: true })
    await session.detach()
    const violations = JSON.parse(answer.result.value)
    const barriers = violations.map((one) => `${one.id}: ${one.nodes.slice(0, 3).map((node) => `${node.target} ${node.any[0]?.message ?? ''}`).join('; ')}`)
    this.barriers.push(...barriers.map((one) => `${where}: ${one}`))
  }

  /** Checks both themes with axe and takes pictures on request. */
  async snapshot(page, what) {
    for (const scheme of ['light', 'dark']) {
      await page.emulateMedia({ colorScheme: scheme })
      await page.waitForTimeout(150)
      await this.accessible(page, `${what}, ${scheme}`)
      if (shots)
        for (const [width, height] of [[1440, 900], [1280, 800]]) {
          await page.setViewportSize({ width, height })
          await page.waitForTimeout(150)
          await page.screenshot({ path: join(shots, `${what}-${scheme}-${width}.png`) })
        }
    }
    await page.emulateMedia({ colorScheme: 'light' })
  }

  async step(what, work) {
    const start = Date.now()
    try {
      await work()
    } catch (error) {
      error.message = `${what}: ${error.message}`
      throw error
    }
    this.done += 1
    console.log(`ok ${what} (${((Date.now() - start) / 1000).toFixed(1)} s)`)
  }

  /** Prints the state of all pages after a failure. */
  async report() {
    for (const context of this.browser.contexts())
      for (const page of context.pages()) {
        console.error((await page.locator('header, [role=alert], ol[aria-label=Messages], main').allInnerTexts()).join(' | ').replace(/\s+/g, ' '))
        if (shots) await page.screenshot({ path: join(shots, 'failed.png') })
      }
    console.error(`messages so far: ${this.messages.join(' | ') || 'none'}`)
    if (this.complaints.length) console.error(this.complaints.join('\n'))
    if (this.barriers.length) console.error([...new Set(this.barriers)].join('\n'))
  }
}

/** Serves a new project and opens a browser. */
export async function play(work, values = SLOW, options = []) {
  if (shots) mkdirSync(shots, { recursive: true })
  const scene = new Scene(values, options)
  await scene.serve()
  scene.browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync', ...(built ? ['--disable-features=LocalNetworkAccessChecks'] : [])],
  })
  try {
    await work(scene)
    assert.deepEqual(scene.complaints, [], 'no console errors')
    assert.deepEqual(scene.barriers, [], 'no accessibility violations')
    console.log(`${scene.done} passed`)
  } catch (error) {
    await scene.report()
    throw error
  } finally {
    await scene.browser.close()
    await scene.bench.stop()
    rmSync(scene.project, { recursive: true, force: true })
  }
}
