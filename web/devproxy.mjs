import http from 'node:http'; import net from 'node:net'; import { readFileSync, existsSync } from 'node:fs'
const [target, listen, project] = [Number(process.argv[2]), Number(process.argv[3]), process.argv[4]]
const types = { html:'text/html', js:'text/javascript', css:'text/css', svg:'image/svg+xml', woff2:'font/woff2' }
const head = (q) => { const t = readFileSync(project + '/serve-token','utf8'); const h = { ...q.headers, host: `127.0.0.1:${target}`, authorization: 'Bearer ' + t }; if (h.origin) h.origin = `http://127.0.0.1:${target}`; return h }
const s = http.createServer((q, r) => {
  const path = new URL(q.url, 'http://x').pathname
  if (path.startsWith('/api')) { const o = http.request({ port: target, host: '127.0.0.1', path: q.url, method: q.method, headers: head(q) }, a => { r.writeHead(a.statusCode, a.headers); a.pipe(r) }); o.on('error', () => { r.writeHead(502); r.end() }); return q.pipe(o) }
  let f = 'dist' + path; if (!path.includes('.')) f = 'dist/index.html'
  if (!existsSync(f)) { r.writeHead(404); return r.end() }
  r.writeHead(200, { 'content-type': types[f.split('.').pop()], 'content-security-policy': "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'" }); r.end(readFileSync(f))
})
s.on('upgrade', (q, c, first) => { const o = net.connect(target, '127.0.0.1', () => { const h = head(q); o.write(`${q.method} ${q.url} HTTP/1.1\r\n` + Object.entries(h).map(([k,v]) => `${k}: ${v}`).join('\r\n') + '\r\n\r\n'); o.write(first); o.pipe(c); c.pipe(o) }); o.on('error', () => c.destroy()); c.on('error', () => o.destroy()) })
s.listen(listen, '127.0.0.1')
