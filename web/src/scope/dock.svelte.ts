// Whether the scope is open below each window, how high it is, and what it can do.

import { bench, store, stored } from '../bench.svelte'
import { type Command, dock as table } from '../commands'
import { save } from '../plot/export'
import { view } from '../view.svelte'
import { scope } from './scope.svelte'

const KEPT = 'stickslip.dock'
/** The bar, and the least height of what is open [px]. */
export const BAR = 36
export const LEAST = 120
const MOST = 0.6
/** Below this height of the page it is closed at first [px]. */
const ROOM = 860

class Dock {
  height = $state(280)
  /** Whether there was room for it at first. */
  #roomy = innerHeight >= ROOM
  #open = $state<Record<string, boolean>>({})
  side = $state<'signals' | 'readout' | ''>('signals')
  panel = $state<'' | 'trigger' | 'export'>('')
  /** Whether its keys come before those of the window: the pointer or the focus is in it. */
  within = false

  constructor() {
    try {
      const kept = JSON.parse(stored(KEPT, '{}')) as { height?: number; open?: Record<string, boolean>; side?: Dock['side'] }
      this.height = kept.height ?? this.height
      this.#open = kept.open ?? {}
      this.side = kept.side ?? (innerHeight < ROOM ? '' : this.side)
    } catch {
      // What cannot be read is forgotten.
    }
    table.commands = () => [...(this.full || this.open ? this.#commands() : []), { name: 'Scope', key: 'S', run: () => this.toggle() }]
    table.first = () => this.within || this.full
  }

  get full(): boolean {
    return view.path === '/scope'
  }

  get open(): boolean {
    return this.#open[view.path] ?? (view.path === '/' && this.#roomy)
  }

  toggle() {
    if (this.full) return
    this.#open = { ...this.#open, [view.path]: !this.open }
    this.keep()
  }

  resize(height: number) {
    this.height = Math.round(Math.min(Math.max(height, LEAST), MOST * innerHeight))
    this.keep()
  }

  keep() {
    store(KEPT, JSON.stringify({ height: this.height, open: this.#open, side: this.side }))
  }

  show(side: Dock['side']) {
    this.side = this.side === side ? '' : side
    this.keep()
  }

  popOut() {
    open('/scope', 'stickslip-scope', 'width=1280,height=800')
  }

  record() {
    if (bench.status?.recording) void bench.tried(bench.connection.call({ call: 'end_record' }, 'done')).then((ended) => ended && bench.say('The recording is in the catalogue'))
    else void bench.order({ call: 'record', name: 'scope' })
  }

  async leave(kind: 'svg' | 'png' | 'visible' | 'cursors' | 'all') {
    this.panel = ''
    const [{ figures, span, table }, { raster, stacked }] = await Promise.all([import('./files'), import('../plot/export')])
    if (kind === 'svg' || kind === 'png') {
      const all = figures()
      if (!all.length) return bench.warn('No pane shows anything')
      const text = stacked(all)
      if (kind === 'svg') return save('scope.svg', 'image/svg+xml', text)
      const [, width, height] = /width="(\d+)" height="(\d+)"/.exec(text)!
      return save('scope.png', 'image/png', await raster(text, Number(width), Number(height)))
    }
    const part = span(kind)
    if (!part || part[1] < part[0]) return bench.warn(kind === 'cursors' ? 'Set both cursors first: A and B' : 'There is nothing yet')
    save('scope.csv', 'text/csv', table(part))
  }

  /** At the pointer; else in the middle of what is seen. */
  #at(): number {
    return scope.pointer?.cycle ?? (scope.view.from + scope.view.to) / 2
  }

  #commands(): Command[] {
    return [
      { name: 'Scope: hold or go on', key: 'Space', run: () => scope.hold() },
      { name: 'Scope: cursor A at the pointer', key: 'A', run: () => scope.put('a', this.#at()) },
      { name: 'Scope: cursor B at the pointer', key: 'B', run: () => scope.put('b', this.#at()) },
      { name: 'Scope: no cursors', key: '', run: () => (scope.cursors = { a: null, b: null }) },
      { name: 'Scope: trigger level at the pointer', key: 'T', run: () => this.#level(), off: () => (scope.pointer ? null : 'The pointer is over no pane') },
      { name: 'Scope: everything in view', key: '0', run: () => scope.all() },
      { name: 'Scope: previous view', key: '[', run: () => scope.back() },
      { name: 'Scope: next view', key: ']', run: () => scope.forth() },
      { name: 'Scope: export', key: 'E', run: () => (this.panel = this.panel === 'export' ? '' : 'export') },
      { name: 'Scope: pane over time', key: '', run: () => scope.addPane('time') },
      { name: 'Scope: pane of one signal over another', key: '', run: () => scope.addPane('xy') },
      { name: 'Scope: default panes', key: '', run: () => void scope.reset() },
      { name: 'Frame times', key: '', run: () => void this.#frames() },
    ]
  }

  #level() {
    const { pointer } = scope
    const pane = scope.panes.find((pane) => pane.id === pointer?.pane)
    if (!pointer || !pane?.traces.length) return
    if (!pane.traces.some((trace) => trace.name === scope.trigger.signal)) scope.trigger.signal = pane.traces[0]!.name
    scope.trigger.level = pointer.value
    scope.arm(scope.trigger.mode === 'off' ? 'auto' : scope.trigger.mode)
  }

  async #frames() {
    const [frames, drawing, begun] = [scope.frames, scope.drawing, performance.now()]
    await new Promise((resolve) => setTimeout(resolve, 2000))
    const count = scope.frames - frames
    if (!count) return bench.say('The scope is not drawn')
    const rate = (1000 * count) / (performance.now() - begun)
    bench.say(`Scope: ${rate.toFixed(0)} pictures a second, ${((scope.drawing - drawing) / count).toFixed(1)} ms each`)
  }
}

export const dock = new Dock()
