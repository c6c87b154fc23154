import { chromium } from 'playwright-core'
import { readFileSync, existsSync } from 'node:fs'
const url = 'http://127.0.0.1:9872/'
const out = '/tmp/shots'; import('node:fs').then(fs=>fs.mkdirSync(out,{recursive:true}))
const b = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox','--disable-features=LocalNetworkAccessChecks,LocalNetworkAccessChecksWebSockets','--disable-gpu','--disable-quic','--no-first-run','--disable-background-networking','--disable-component-update','--disable-sync'] })
const types = { html:'text/html', js:'text/javascript', css:'text/css', svg:'image/svg+xml', woff2:'font/woff2' }
export async function open(size, scheme, name='Anna', path='/') {
  const c = await b.newContext({ viewport: size, colorScheme: scheme })
  await c.addInitScript((n)=>{ if(!localStorage.getItem('stickslip.name')) localStorage.setItem('stickslip.name', n) }, name)
  const p = await c.newPage()
  p.on('console', m => { if (m.type()!=='log' && m.type()!=='debug') console.log('console', m.type(), m.text()) })
  p.on('pageerror', e => console.log('pageerror', e.message))
  await p.goto(url).catch(()=>{})
  await p.goto(new URL(path, url).href)
  await p.waitForTimeout(900)
  return p
}
export const shot = (p, n) => p.screenshot({ path: `${out}/${n}.png` })
export const done = () => b.close()
