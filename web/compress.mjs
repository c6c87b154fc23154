// Compresses what Vite has built, beside it: the program embeds these and serves them as they are.
import { readdirSync, readFileSync, writeFileSync } from 'node:fs'
import { join } from 'node:path'
import { brotliCompressSync, constants, gzipSync } from 'node:zlib'

const built = process.env.STICKSLIP_PAGE_OUT ?? 'dist'
for (const entry of readdirSync(built, { recursive: true, withFileTypes: true })) {
  if (!entry.isFile() || /\.(br|gz)$/.test(entry.name)) continue
  const path = join(entry.parentPath, entry.name)
  const text = readFileSync(path)
  const settings = { params: { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_SIZE_HINT]: text.length } }
  writeFileSync(`${path}.br`, brotliCompressSync(text, settings))
  writeFileSync(`${path}.gz`, gzipSync(text, { level: 9 }))
}
