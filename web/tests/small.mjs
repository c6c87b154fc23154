// Details that spoil the work: messages over controls, a download without progress, an empty scope while a trigger waits.

import assert from 'node:assert/strict'
import { caller, play, state } from './harness.mjs'

const WINDOWS = ['/', '/friction', '/design', '/controller', '/test', '/simulation', '/implementation', '/runs', '/help', '/scope']
const SIZES = [{ width: 1440, height: 900 }, { width: 1280, height: 800 }, { width: 390, height: 844 }]

/** Controls that a message covers. */
function covered() {
  const messages = [...document.querySelectorAll('ol[aria-label=Messages] li')]
  const boxes = messages.map((one) => one.getBoundingClientRect())
  return [...document.querySelectorAll('button, a[href], input, select, [role=slider], [role=tab]')].flatMap((one) => {
    if (messages.some((message) => message.contains(one)) || !one.checkVisibility()) return []
    const box = one.getBoundingClientRect()
    const [x, y] = [box.left + box.width / 2, box.top + box.height / 2]
    // A control that has been scrolled out of the window is not covered.
    const view = one.closest('.window')?.getBoundingClientRect()
    if (view && (y > view.bottom || y < view.top)) return []
    const at = document.elementFromPoint(x, y)
    const hit = at && messages.some((message) => message.contains(at)) && boxes.some((b) => b.left < box.right && box.left < b.right && b.top < box.bottom && box.top < b.bottom)
    return hit ? [one.ariaLabel || one.innerText.slice(0, 30) || one.tagName] : []
  })
}

await play(async (scene) => {
  const ann = await scene.page('Ann')
  ann.setDefaultTimeout(30_000)
  const call = caller(ann)

  await scene.step('messages cover no control, in any window and at any size', async () => {
    await ann.goto(scene.bench.address.href)
    const all = []
    for (const path of WINDOWS) {
      await ann.goto(scene.bench.address.origin + path)
      await ann.getByRole('main').waitFor()
      await state(ann).getByText('Off').waitFor()
      for (const size of SIZES) {
        await ann.setViewportSize(size)
        // Messages close after some seconds.
        while ((await ann.getByText(/^Theme: /).count()) < 3) await ann.keyboard.press('Shift+D')
        all.push(...(await ann.evaluate(covered)).map((one) => `${path}, ${size.width}: ${one}`))
        if (path === '/' && process.env.SHOTS) await ann.screenshot({ path: `${process.env.SHOTS}/messages-${size.width}.png` })
      }
    }
    assert.deepEqual(all, [])
  })
  await scene.step('a download shows its progress until the target has the values', async () => {
    await ann.setViewportSize(SIZES[0])
    // A slow check on the target: it ends when the progress has been seen.
    let end
    const seen = new Promise((resolve) => (end = resolve))
    await ann.routeWebSocket(/api\/live/, (socket) => {
      const server = socket.connectToServer()
      socket.onMessage(async (message) => {
        if (/"set"/.test(message)) await seen
        server.send(message)
      })
    })
    await ann.goto(`${scene.bench.address.origin}/controller`)
    const gain = ann.getByRole('region', { name: 'Gains' }).getByRole('textbox', { name: /position gain/ })
    await gain.fill('12')
    await gain.press('Enter')
    await ann.getByRole('button', { name: /^Download 1 change/ }).click()
    const dialog = ann.getByRole('dialog', { name: /Download controller/ })
    await dialog.getByRole('button', { name: /^Download 1/ }).click()
    await dialog.getByText('Checking and downloading…').waitFor()
    await ann.getByRole('progressbar', { name: 'Download to the target' }).waitFor()
    assert.ok(await dialog.getByRole('button', { name: /^Download 1/ }).isDisabled())
    await scene.snapshot(ann, 'download-progress')
    end()
    await ann.getByText(/Controller active on the target/).waitFor()
    await dialog.waitFor({ state: 'detached' })
    assert.equal(await ann.getByRole('progressbar', { name: 'Download to the target' }).count(), 0)
  })
  await scene.step('the scope is live while a trigger waits for its first event', async () => {
    await ann.goto(`${scene.bench.address.origin}/scope`)
    await ann.getByRole('button', { name: /^Trigger/ }).click()
    const trigger = ann.getByRole('group', { name: 'Trigger' })
    // A signal is selected, also after a reload, as soon as the signals of the bench are known.
    await trigger.getByLabel('Signal').and(ann.locator('select:has(option:checked:not([value=""]))')).waitFor()
    await trigger.getByLabel('Level').fill('1e6')
    await trigger.getByLabel('Level').press('Enter')
    await trigger.getByRole('button', { name: 'Normal' }).click()
    await ann.reload()
    await ann.getByRole('button', { name: /^Trigger: normal, waiting/ }).waitFor()
    await ann.waitForTimeout(1500)
    const drawn = await ann.evaluate(() =>
      [...document.querySelectorAll('canvas.dense')].map((canvas) => {
        if (!canvas.width || !canvas.height) return 0
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height)
        return data.filter((value, n) => n % 4 === 3 && value > 0).length
      }),
    )
    assert.ok(drawn.length && drawn.every((pixels) => pixels > 50), `pixels of the traces: ${drawn}`)
    assert.equal((await call({ call: 'status' })).state, 'off')
  })
})
