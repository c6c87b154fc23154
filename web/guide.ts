// The guide for the page: converted to HTML when the page is built, from the text of the book.

import { createHash } from 'node:crypto'
import { existsSync, readdirSync, readFileSync } from 'node:fs'
import { dirname, join, parse, resolve } from 'node:path'
import { Marked, type Token, type Tokens } from 'marked'
import type { Plugin } from 'vite'

export type Page = { name: string; title: string; chapter: string; html: string }

const BOOK = resolve(import.meta.dirname, '../docs/src')
const NAME = 'virtual:guide'

/** The text of a file with its includes. */
function expand(file: string, files: Set<string>): string {
  files.add(file)
  return readFileSync(file, 'utf8').replace(/\{\{#include ([^}]+)\}\}/g, (_, path: string) => expand(resolve(dirname(file), path.trim()), files))
}

/** The anchor of a heading, as mdBook writes it. */
export function slug(text: string): string {
  return text.toLowerCase().replace(/<[^>]*>/g, '').replace(/[^\p{L}\p{N}\s_-]/gu, '').trim().replace(/\s+/g, '-')
}

/** The plain text of a heading. */
function plain(token: Token): string {
  return 'tokens' in token && token.tokens ? token.tokens.map(plain).join('') : 'text' in token ? String(token.text) : ''
}

const escaped = (text: string) => text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('"', '&quot;')

/** HTML of symbols and equations is kept; other HTML is escaped. */
function symbols(text: string): string {
  return text.replaceAll('<', '&lt;').replaceAll('"', '&quot;').replace(/&lt;(\/?(?:su[bp]|i|p|span))( class=&quot;(?:equation|number)&quot;)?>/g, (_, tag: string, kind = '') => `<${tag}${kind.replaceAll('&quot;', '"')}>`)
}

/** One page of the guide; `figure` returns the address of a figure. */
export function renderPage(name: string, chapter: string, text: string, names: Set<string>, figure: (path: string) => string | null): Page {
  const anchors = new Map<string, number>()
  let title = ''
  const marked = new Marked({ gfm: true })
  const anchorOf = new Map<Token, string>()
  const tokens = marked.lexer(text)
  for (const token of tokens) {
    if (token.type === 'heading') {
      const words = plain(token)
      const base = slug(words)
      const times = anchors.get(base) ?? 0
      anchors.set(base, times + 1)
      const anchor = times ? `${base}-${times}` : base
      anchorOf.set(token, anchor)
      title ||= words
    }
  }
  marked.use({
    renderer: {
      heading(token) {
        return `<h${token.depth} id="${anchorOf.get(token) ?? ''}">${this.parser.parseInline(token.tokens)}</h${token.depth}>`
      },
      link(token) {
        const words = this.parser.parseInline(token.tokens)
        const [path = '', anchor = ''] = token.href.split('#')
        if (/^https?:/.test(token.href)) return `<a href="${escaped(token.href)}" target="_blank" rel="noreferrer">${words}</a>`
        const page = path ? path.replace(/\.md$/, '') : name
        return names.has(page) ? `<a href="/help?page=${page}${anchor ? `&amp;at=${encodeURIComponent(anchor)}` : ''}">${words}</a>` : words
      },
      image(token) {
        const address = figure(token.href)
        return address ? `<img src="${address}" alt="${escaped(token.text)}" loading="lazy">` : `<em>${escaped(token.text)}</em>`
      },
      html: (token) => symbols(token.text),
      table(token) {
        const row = (cells: Tokens.TableCell[], tag: string) => `<tr>${cells.map((cell) => `<${tag}>${this.parser.parseInline(cell.tokens)}</${tag}>`).join('')}</tr>`
        return `<div class="wide" tabindex="0"><table><thead>${row(token.header, 'th')}</thead><tbody>${token.rows.map((cells) => row(cells, 'td')).join('')}</tbody></table></div>`
      },
      code: (token) => `<pre tabindex="0"><code>${escaped(token.text)}</code></pre>`,
    },
  })
  return { name, title, chapter, html: marked.parser(tokens) }
}

/** Name and chapter of each page, in the order of the book. */
export function contents(summary: string): { name: string; chapter: string }[] {
  const pages: { name: string; chapter: string }[] = []
  let chapter = ''
  for (const line of summary.split('\n')) {
    const heading = /^# (.*)$/.exec(line)
    const page = /\]\(([\w-]+)\.md\)/.exec(line)
    if (heading) chapter = heading[1] === 'Summary' ? '' : heading[1]!
    if (page) pages.push({ name: page[1]!, chapter })
  }
  return pages
}

/** The guide as a virtual module, and its figures as files. */
export function guide(): Plugin {
  let dev = false
  return {
    name: 'guide',
    configResolved(config) {
      dev = config.command === 'serve'
    },
    resolveId: (id) => (id === NAME ? `\0${NAME}` : null),
    load(id) {
      if (id !== `\0${NAME}`) return null
      const files = new Set<string>()
      const listed = contents(readFileSync(join(BOOK, 'SUMMARY.md'), 'utf8'))
      const names = new Set(listed.map((page) => page.name))
      const figure = (path: string) => {
        const file = join(BOOK, path)
        // Pictures of the page are left out: the reader has the page itself.
        if (!existsSync(file) || dev || path.includes('figures/page/')) return null
        const source = readFileSync(file)
        const { name, ext } = parse(file)
        const fileName = `assets/${name}-${createHash('sha256').update(source).digest('base64url').slice(0, 8)}${ext}`
        this.emitFile({ type: 'asset', fileName, source })
        return `/${fileName}`
      }
      const pages = listed.map(({ name, chapter }) => renderPage(name, chapter, expand(join(BOOK, `${name}.md`), files), names, figure))
      for (const file of [...files, join(BOOK, 'SUMMARY.md'), ...readdirSync(BOOK).map((name) => join(BOOK, name))]) this.addWatchFile(file)
      return `export const pages = ${JSON.stringify(pages)}`
    },
  }
}
