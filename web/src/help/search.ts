// What a search in the help finds: sections of the guide, parameters, commands.

import type { Page } from '../../guide'
import type { Item } from '../protocol'

/** What stands under a heading. */
export type Section = { page: Page; anchor: string; title: string; text: string }
export type Found =
  | { kind: 'section'; section: Section; excerpt: string }
  | { kind: 'parameter'; item: Item }
  | { kind: 'command'; name: string; key: string }

const MOST = { sections: 30, parameters: 12, commands: 8 }

/** The sections of a page, as they are read. */
export function sections(page: Page): Section[] {
  const found: Section[] = []
  for (const one of new DOMParser().parseFromString(page.html.replaceAll('</t', ' </t'), 'text/html').body.children) {
    const text = one.textContent ?? ''
    const last = found.at(-1)
    if (/^H\d$/.test(one.tagName)) found.push({ page, anchor: one.id, title: text, text: '' })
    else if (last) last.text = `${last.text} ${text.replace(/\s+/g, ' ')}`.trim()
  }
  return found
}

export function words(query: string): string[] {
  return query.toLowerCase().split(/\s+/).filter(Boolean)
}

/** So much of a text around the first word that is found in it. */
export function excerpt(text: string, wanted: string[], around = 80): string {
  const small = text.toLowerCase()
  const places = wanted.map((word) => small.indexOf(word)).filter((place) => place >= 0)
  const place = places.length ? Math.min(...places) : 0
  const from = place < around ? 0 : text.indexOf(' ', place - around) + 1
  const until = Math.min(text.length, from + 3 * around)
  const end = until < text.length ? text.lastIndexOf(' ', until) : until
  return `${from ? '… ' : ''}${text.slice(from, end > from ? end : until)}${end < text.length ? ' …' : ''}`
}

/** The best first: words in a title before words in the text. */
export function search(query: string, guide: Section[], items: Item[], commands: { name: string; key: string }[]): Found[] {
  const wanted = words(query)
  if (!wanted.length) return []
  const all = (text: string) => wanted.every((word) => text.includes(word))
  const ranked = guide.flatMap((section) => {
    const title = section.title.toLowerCase()
    if (!all(`${title} ${section.text.toLowerCase()}`)) return []
    return [{ rank: all(title) ? 0 : wanted.some((word) => title.includes(word)) ? 1 : 2, section }]
  })
  ranked.sort((one, other) => one.rank - other.rank)
  return [
    ...commands.filter((command) => all(command.name.toLowerCase())).slice(0, MOST.commands).map((command) => ({ kind: 'command' as const, name: command.name, key: command.key })),
    ...items.filter((item) => all(`${item.path} ${item.symbol} ${item.help}`.toLowerCase())).slice(0, MOST.parameters).map((item) => ({ kind: 'parameter' as const, item })),
    ...ranked.slice(0, MOST.sections).map(({ section }) => ({ kind: 'section' as const, section, excerpt: excerpt(section.text, wanted) })),
  ]
}
