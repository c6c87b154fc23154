// Values entered in any window before their download to the target. With live editing they act at once.

import { bench } from './bench.svelte'
import { Refused } from './connection'
import type { Offer } from './measurement.svelte'
import type { Changed, Item } from './protocol'

class Entered {
  /** Values by path that differ from the target, in the order of their entry. */
  values = $state.raw<Record<string, string>>({})
  /** The differences that they make on the target, including dependent ones. */
  changes = $state.raw<Changed[]>([])
  /** The parameters that the target would have with the entered kinds; null without one. */
  items = $state.raw<Item[] | null>(null)
  /** Why the target would refuse them. */
  refused = $state('')
  live = $state(false)
  offered = $state.raw<Omit<Offer, 'run'> | null>(null)
  /** The values before a proposal. */
  #before: Record<string, string> | null = null
  #request = 0

  any = $derived(Object.keys(this.values).length > 0)

  /** An item with its entered value. */
  shown(item: Item): Item {
    const value = this.values[item.path]
    if (value === undefined) return item
    if (item.kind === 'choice') return { ...item, choice: value }
    return { ...item, value: item.kind === 'flag' ? Number(value === 'true') : Number(value) }
  }

  /** The value on the target as entered, or that of a new kind; null without one. */
  on({ path }: Item): string | null {
    const item = bench.item(path) ?? this.#item(path)
    if (!item) return null
    if (item.kind === 'choice') return item.choice
    return item.value === null ? null : item.kind === 'flag' ? String(item.value === 1) : String(item.value)
  }

  /** Enters a value; with live editing it is downloaded. */
  async set(item: Item, value: string, what: string) {
    if (this.live) return void (await bench.apply({ [item.path]: value }, what))
    const others = Object.fromEntries(Object.entries(this.values).filter(([path]) => path !== item.path))
    await this.#take(value === this.on(item) ? others : { ...others, [item.path]: value })
  }

  /** Enters values and shows their differences; closing the dialog takes them back. */
  async propose(values: Record<string, string>) {
    const before = this.values
    await this.#take({ ...before, ...values })
    const { refused } = this
    if (refused) {
      await this.#take(before)
      return bench.warn(refused)
    }
    await this.offer()
    this.#before = before
  }

  /** Takes back the last entry. */
  undo() {
    void this.#take(Object.fromEntries(Object.entries(this.values).slice(0, -1)))
  }

  discard() {
    void this.#take({})
  }

  async offer() {
    const { values } = this
    const margin = await bench.connection.call({ call: 'margin', values }, 'margin').catch((error) => {
      if (!(error instanceof Refused)) throw error
      return null
    })
    this.offered = { values, changes: this.changes, margin, refused: null }
  }

  close() {
    this.offered = null
    if (this.#before) void this.#take(this.#before)
    this.#before = null
  }

  async download() {
    const count = this.changes.length
    if (this.offered && (await bench.apply(this.offered.values, `${count} ${count === 1 ? 'value' : 'values'}`))) {
      await bench.refresh()
      await this.#take({})
    }
    this.offered = this.#before = null
  }

  #item(path: string): Item | undefined {
    return this.items?.find((item) => item.path === path)
  }

  /** The parameters with the entered kinds; null without one, or if the target refuses them. */
  async #offered(values: Record<string, string>): Promise<Item[] | null> {
    const kinds = Object.entries(values).filter(([path]) => (bench.item(path) ?? this.#item(path))?.kind === 'choice')
    if (!kinds.length) return null
    return bench.connection.call({ call: 'items', values: Object.fromEntries(kinds) }, 'items').then(
      ({ items }) => items,
      (error) => {
        if (!(error instanceof Refused)) throw error
        return null
      },
    )
  }

  async #take(entries: Record<string, string>) {
    this.values = entries
    const request = ++this.#request
    const items = await this.#offered(entries)
    if (request !== this.#request) return
    // A parameter of another kind is dropped.
    const there = new Set(items?.map((item) => item.path))
    const values = items ? Object.fromEntries(Object.entries(entries).filter(([path]) => there.has(path))) : entries
    this.items = items
    this.values = values
    let [changes, refused]: [Changed[], string] = [[], '']
    if (this.any) {
      try {
        changes = (await bench.connection.call({ call: 'preview', values }, 'differences')).differences
      } catch (error) {
        if (!(error instanceof Refused)) throw error
        refused = error.message
      }
    }
    if (request === this.#request) [this.changes, this.refused] = [changes, refused]
  }
}

export const entered = new Entered()
