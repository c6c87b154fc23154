import { open, shot, done } from './look.mjs'
const S = { width: 1440, height: 900 }
const p = await open(S, 'light')
await shot(p, 'home-light-off')
await p.goto(new URL('/friction', p.url()).href); await p.waitForTimeout(1000)
await shot(p, 'friction-light-empty')
await p.getByRole('button', { name: /Measure/ }).first().click()
await p.waitForTimeout(9000)
await shot(p, 'friction-light-homing')
await p.waitForTimeout(20000)
await shot(p, 'friction-light-running')
await done()
