// Search in the help: sections of the guide, parameters, commands.

import type { Page } from '../../guide'
import type { Item } from '../protocol'

/** A heading and its text. */
export type Section = { page: Page; anchor: string; title: string; text: string }
export type Result =
  | { kind: 'section'; section: Section; excerpt: string }
  | { kind: 'parameter'; item: Item }
  | { kind: 'command'; name: string; key: string }

const MOST = { sections: 30, parameters: 12, commands: 8 }

/** The sections of a page as plain text. */
export function sections(page: Page): Section[] {
  const result: Section[] = []
  for (const one of new DOMParser().parseFromString(page.html.replaceAll('</t', ' </t'), 'text/html').body.children) {
    const text = one.textContent ?? ''
    const last = result.at(-1)
    if (/^H\d$/.test(one.tagName)) result.push({ page, anchor: one.id, title: text, text: '' })
    else if (last) last.text = `${last.text} ${text.replace(/\s+/g, ' ')}`.trim()
  }
  return result
}

export function words(query: string): string[] {
  return query.toLowerCase().split(/\s+/).filter(Boolean)
}

/** The text around the first match. */
export function excerpt(text: string, query: string[], around = 80): string {
  const small = text.toLowerCase()
  const places = query.map((word) => small.indexOf(word)).filter((place) => place >= 0)
  const place = places.length ? Math.min(...places) : 0
  const from = place < around ? 0 : text.indexOf(' ', place - around) + 1
  const until = Math.min(text.length, from + 3 * around)
  const end = until < text.length ? text.lastIndexOf(' ', until) : until
  return `${from ? '… ' : ''}${text.slice(from, end > from ? end : until)}${end < text.length ? ' …' : ''}`
}

/** Best matches first: matches in a title before matches in the text. */
export function search(query: string, guide: Section[], items: Item[], commands: { name: string; key: string }[]): Result[] {
  const terms = words(query)
  if (!terms.length) return []
  const all = (text: string) => terms.every((word) => text.includes(word))
  const ranked = guide.flatMap((section) => {
    const title = section.title.toLowerCase()
    if (!all(`${title} ${section.text.toLowerCase()}`)) return []
    return [{ rank: all(title) ? 0 : terms.some((word) => title.includes(word)) ? 1 : 2, section }]
  })
  ranked.sort((one, other) => one.rank - other.rank)
  return [
    ...commands.filter((command) => all(command.name.toLowerCase())).slice(0, MOST.commands).map((command) => ({ kind: 'command' as const, name: command.name, key: command.key })),
    ...items.filter((item) => all(`${item.path} ${item.symbol} ${item.help}`.toLowerCase())).slice(0, MOST.parameters).map((item) => ({ kind: 'parameter' as const, item })),
    ...ranked.slice(0, MOST.sections).map(({ section }) => ({ kind: 'section' as const, section, excerpt: excerpt(section.text, terms) })),
  ]
}
