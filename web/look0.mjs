import { open, shot, done } from './look.mjs'
const p = await open({ width: 1440, height: 900 }, 'light')
console.log(await p.evaluate(() => new Promise(r => { const w = new WebSocket(`ws://${location.host}/api/live?client=x`); w.onopen=()=>{w.send('{"id":1,"call":"status"}')}; w.onmessage=m=>r('msg '+m.data.slice(0,300)); w.onerror=()=>r('error'); w.onclose=e=>r('close '+e.code+e.reason); setTimeout(()=>r('timeout'),4000) })))
await p.waitForTimeout(2000)
await shot(p, 'home')
await done()
