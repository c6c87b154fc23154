// Pictures of every window, dialog and popup with data: `SHOTS=folder node tests/pictures.mjs [screen] [window]`. At device
// pixel ratio 2, 1440 wide and on a phone, light and dark.

import { join } from 'node:path'
import { caller, play, state } from './harness.mjs'

const SCREENS = { wide: { deviceScaleFactor: 2 }, phone: { width: 390, height: 844, deviceScaleFactor: 2, isMobile: true, hasTouch: true } }
const PATHS = ['/', '/scope', '/friction', '/design', '/controller', '/test', '/simulation', '/implementation', '/runs', '/help']
const [onlyScreen, onlyWindow] = process.argv.slice(2)
const folder = process.env.SHOTS

await play(async (scene) => {
  const first = await scene.page('Ann')
  const call = caller(first)
  const ended = async (body) => {
    const answer = await call(body)
    if (answer.answer === 'error') throw new Error(answer.error)
    do await first.waitForTimeout(200)
    while ((await call({ call: 'status' })).doing)
  }
  const open = (page, path) => page.goto(scene.bench.address.origin + path).then(() => page.getByRole('main').waitFor())
  await scene.step('data', async () => {
    await first.goto(scene.bench.address.href)
    await state(first).getByText('Off').waitFor()
    await ended({ call: 'home' })
    await ended({ call: 'measure', what: 'friction', plan: { slowest: '1', fastest: '40', speeds: '8' } })
    await ended({ call: 'trial', motion: 'reversal', repetitions: 2 })
    await call({ call: 'set', values: { 'bench.controller.position_gain': '8' } })
    await ended({ call: 'trial', motion: 'reversal', repetitions: 2 })
    await call({ call: 'undo' })
    await ended({ call: 'compare', controllers: ['active', 'pid'], manoeuvres: ['sine_2hz'], repetitions: 2, render: false })
  })
  const runs = (await call({ call: 'runs', query: '' })).runs
  await first.context().close()

  /** The windows, and what can be opened in them. */
  const views = {
    ...Object.fromEntries(PATHS.map((path) => [path === '/' ? 'home' : path.slice(1), (page) => open(page, path)])),
    compare: (page) => open(page, '/test?compare'),
    'run-test': (page) => open(page, `/runs?run=${runs.find((run) => run.kind === 'trial').number}`),
    'run-comparison': (page) => open(page, `/runs?run=${runs.find((run) => run.kind === 'benchmark').number}`),
    'run-friction': (page) => open(page, `/runs?run=${runs.find((run) => run.kind === 'measure friction').number}`),
    palette: (page) => open(page, '/').then(() => page.keyboard.press('Control+k')),
    keys: (page) => open(page, '/').then(() => page.keyboard.press('?')),
    messages: (page) => open(page, '/').then(() => page.keyboard.press('Shift+M')),
    toasts: (page) => open(page, '/design').then(async () => { for (let k = 0; k < 3; k += 1) await page.keyboard.press('Shift+D') }),
    settings: (page) => command(page, 'Settings'),
    sets: (page) => command(page, 'Parameter sets'),
    close: (page) => command(page, 'Close'),
    project: (page) => open(page, '/').then(() => page.getByRole('button', { name: /^Project/ }).first().click()),
    drawer: (page) => open(page, '/').then(() => page.getByRole('button', { name: /^Controller/ }).first().click()),
    trigger: (page) => open(page, '/scope').then(() => page.getByRole('button', { name: /^Trigger/ }).click()),
    signals: (page) => open(page, '/scope').then(() => page.getByRole('button', { name: /^Signals|^Add/ }).first().click()),
    library: (page) => open(page, '/design').then(() => page.getByRole('button', { name: /Library/ }).first().click()),
    download: (page) => open(page, '/controller').then(async () => {
      const gain = page.getByRole('region', { name: 'Gains' }).getByRole('textbox', { name: /position gain/ })
      await gain.fill('12')
      await gain.press('Enter')
      await page.getByRole('button', { name: /^Download 1 change/ }).click()
    }),
  }
  const command = async (page, name) => {
    await open(page, '/')
    await page.keyboard.press('Control+k')
    await page.keyboard.type(name)
    await page.waitForTimeout(300)
    await page.keyboard.press('Enter')
  }
  for (const [name, screen] of Object.entries(SCREENS).filter(([name]) => !onlyScreen || name === onlyScreen))
    for (const colorScheme of ['light', 'dark']) {
      const page = await scene.page('Ann', { ...screen, colorScheme })
      page.setDefaultTimeout(8000)
      await page.goto(scene.bench.address.href)
      for (const [what, show] of Object.entries(views).filter(([what]) => !onlyWindow || what === onlyWindow))
        try {
          await show(page)
          await page.waitForTimeout(1200)
          await page.screenshot({ path: join(folder, `${name}-${what}-${colorScheme}.png`) })
          // On a phone the rest of the window, too.
          if (name === 'phone') {
            const height = await page.evaluate(() => document.querySelector('.window').scrollHeight)
            await page.setViewportSize({ width: screen.width, height: Math.min(Math.max(844, height + 200), 4000) })
            await page.waitForTimeout(400)
            await page.screenshot({ path: join(folder, `${name}-${what}-${colorScheme}-all.png`) })
            await page.setViewportSize({ width: screen.width, height: screen.height })
          }
          await page.keyboard.press('Escape')
        } catch (error) {
          console.log(`${name} ${what}: ${error.message.split('\n')[0]}`)
        }
      await page.context().close()
    }
})
