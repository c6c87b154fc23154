// What the scope shows: panes with signals and computed channels, and their storage.

import { store, stored } from '../bench.svelte'
import { type Formula, read, Unreadable } from './formula'
import { Source, STORAGE } from './source.svelte'
import type { Signal } from '../protocol'

/** Delay after which a changed layout is stored in the project [ms]. */
const LAYOUT = 1500

export type Trace = { name: string; hidden: boolean }
export type Pane = { id: number; kind: 'time' | 'xy' | 'spectrum'; traces: Trace[]; range: [number, number] | null }
/** A computed channel: name, formula and unit. */
export type Channel = { name: string; text: string; unit: string }
/** What is stored besides the panes. */
type Settings = Record<string, unknown>
type Stored = Settings & { channels?: Channel[]; panes?: { kind: Pane['kind']; names: string[] }[] }

export abstract class Layout extends Source {
  /** Signals of the program, then computed channels. */
  signals = $state.raw<Signal[]>([])
  channels = $state.raw<Channel[]>([])
  panes = $state<Pane[]>([])
  active = $state(0)
  #timer = 0
  #pane = 0

  /** Settings to be stored with the panes, and to be restored. */
  protected abstract get settings(): Settings
  protected abstract restoreSettings(settings: Settings, panes: string[][]): void

  /** Signals in the panes that the program has: their indices and names. */
  protected shown(): [number, string][] {
    const names = this.panes.flatMap((pane) => pane.traces.map((trace) => trace.name))
    return this.streamed.flatMap(({ name }, index): [number, string][] => (names.includes(name) ? [[index, name]] : []))
  }

  // Computed channels.

  /** Parses a formula. @throws {Unreadable} */
  formula(text: string): Formula {
    return read(text, { index: (name) => this.streamed.findIndex((signal) => signal.name === name), rate: this.rate })
  }

  /** Adds a channel or replaces the one with its name. @throws {Unreadable} */
  compute(typed: string, unit: string) {
    const { name, text } = this.formula(typed)
    if (this.streamed.some((signal) => signal.name === name)) throw new Unreadable(`the name ${name} is already a signal; choose another name before =`)
    this.channels = [...this.channels.filter((channel) => channel.name !== name), { name, text, unit }]
    this.derive()
    this.add(name)
  }

  removeChannel(name: string) {
    this.channels = this.channels.filter((channel) => channel.name !== name)
    for (const pane of [...this.panes]) this.remove(pane.id, name)
    this.derive()
    this.keep()
  }

  isComputed(name: string): boolean {
    return this.index(name) >= this.streamed.length
  }

  protected derive() {
    const usable: { channel: Channel; formula: Formula }[] = []
    for (const channel of this.channels) {
      try {
        usable.push({ channel, formula: this.formula(channel.text) })
      } catch {
        // This bench does not have the signals; another one may.
      }
    }
    for (const ring of this.rings) ring.derive(usable.map(({ formula }) => formula.start))
    const computed = usable.map(({ channel: { name, text, unit } }) => ({ name, label: name, symbol: '', unit, printed_unit: unit, help: `Computed: ${text}.`, values: [] }))
    this.signals = [...this.streamed, ...computed]
  }

  index(name: string): number {
    return this.signals.findIndex((signal) => signal.name === name)
  }

  // Panes.

  add(name: string, id = this.active) {
    const pane = this.panes.find((pane) => pane.id === id) ?? this.panes.at(-1)
    if (!pane || this.index(name) < 0) return void this.addPane('time', [name])
    if (!pane.traces.some((trace) => trace.name === name)) pane.traces.push({ name, hidden: false })
    this.active = pane.id
    this.keep()
  }

  remove(id: number, name: string) {
    const pane = this.panes.find((pane) => pane.id === id)
    if (!pane) return
    pane.traces = pane.traces.filter((trace) => trace.name !== name)
    if (!pane.traces.length && this.panes.length > 1) this.removePane(id)
    this.keep()
  }

  addPane(kind: Pane['kind'], names: string[] = []) {
    const id = ++this.#pane
    this.panes.push({ id, kind, traces: names.filter((name) => this.index(name) >= 0).map((name) => ({ name, hidden: false })), range: null })
    this.active = id
    this.keep()
  }

  removePane(id: number) {
    this.panes = this.panes.filter((pane) => pane.id !== id)
    if (!this.panes.length) this.addPane('time')
    if (!this.panes.some((pane) => pane.id === this.active)) this.active = this.panes[0]!.id
    this.keep()
  }

  /** Shows only this trace, or all traces of its pane again. */
  isolate(id: number, name: string) {
    const pane = this.panes.find((pane) => pane.id === id)
    if (!pane) return
    const alone = pane.traces.every((trace) => trace.hidden === (trace.name !== name))
    for (const trace of pane.traces) trace.hidden = !alone && trace.name !== name
  }

  // Settings kept across reloads.

  keep() {
    const { panes, channels, settings } = this
    const layout = JSON.stringify({ ...settings, channels, panes: panes.map(({ kind, traces }) => ({ kind, names: traces.map((trace) => trace.name) })) })
    if (layout === stored(STORAGE, '')) return
    store(STORAGE, layout)
    clearTimeout(this.#timer)
    // That of the operator becomes the layout of the project.
    this.#timer = window.setTimeout(() => void this.connection?.call({ call: 'keep_layout', layout }, 'done').catch(() => {}), LAYOUT)
  }

  protected opened(panes: string[][], layout: string) {
    if (!this.panes.length) this.#restore(panes, layout)
  }

  /** Restores the panes of a layout, or the default panes of the program. */
  #restore(otherwise: string[][], layout: string) {
    let settings: Stored = {}
    try {
      settings = JSON.parse(layout || '{}') as Stored
    } catch {
      // Unreadable settings are ignored.
    }
    this.channels = settings.channels ?? []
    this.derive()
    for (const { kind, names } of settings.panes ?? otherwise.map((names) => ({ kind: 'time' as const, names }))) this.addPane(kind, names)
    this.restoreSettings(settings, otherwise)
    this.active = this.panes[0]?.id ?? 0
  }

  /** Restores the default panes. */
  async reset() {
    store(STORAGE, '{}')
    if (!this.connection?.open) return
    const offer = await this.connection.call({ call: 'signals' }, 'signals')
    this.panes = []
    this.#restore(offer.panes, '')
    this.keep()
  }
}
