// State and commands of the scope at the bottom of each window.

import { bench, store, stored } from '../bench.svelte'
import { type Command, dock as table } from '../commands'
import { save } from '../plot/export'
import type { FaultStatus } from '../protocol'
import { view } from '../view.svelte'
import { captures, type Kind } from './captures.svelte'
import { scope } from './scope.svelte'

const STORAGE = 'stickslip.dock'
/** Height of the bar and minimum height of the open scope [px]. */
export const BAR = 36
export const LEAST = 120
const MOST = 0.6
/** Below this height of the page, the list of signals is closed by default [px]. */
const ROOM = 860

class Dock {
  height = $state(280)
  #open = $state<Record<string, boolean>>({})
  side = $state<'signals' | 'readout' | 'captures' | ''>('signals')
  panel = $state<'' | 'trigger' | 'export'>('')
  /** True if its keys have priority: the pointer or the focus is inside. */
  within = false

  constructor() {
    try {
      const settings = JSON.parse(stored(STORAGE, '{}')) as { height?: number; open?: Record<string, boolean>; side?: Dock['side'] }
      this.height = settings.height ?? this.height
      this.#open = settings.open ?? {}
      this.side = settings.side ?? (innerHeight < ROOM ? '' : this.side)
    } catch {
      // Unreadable settings are ignored.
    }
    table.commands = () => [...(this.full || this.open ? this.#commands() : []), { name: 'Scope', key: 'S', run: () => this.toggle() }]
    table.first = () => this.within || this.full
  }

  get full(): boolean {
    return view.path === '/scope'
  }

  get open(): boolean {
    return this.#open[view.path] ?? false
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
    store(STORAGE, JSON.stringify({ height: this.height, open: this.#open, side: this.side }))
  }

  show(side: Dock['side']) {
    this.side = this.side === side ? '' : side
    this.keep()
  }

  popOut() {
    open('/scope', 'stickslip-scope', 'width=1280,height=800')
  }

  record() {
    if (bench.status?.recording) void bench.attempt(bench.connection.call({ call: 'end_record' }, 'done')).then((ended) => ended && bench.notify('Recording saved in the catalogue'))
    else void bench.command({ call: 'record', name: 'scope' })
  }

  /** Shows the signals around a fault: from 2 s before it to 0.5 s after. */
  async showFault({ cycle, capture, code }: FaultStatus) {
    if (!this.full && !this.open) this.toggle()
    const rate = bench.status?.rate ?? 0
    const range: [number, number] = [cycle - 2 * rate, cycle + rate / 2]
    if (capture !== null) return void (await captures.open(capture, `fault, ${code.replaceAll('-', ' ')}`, range))
    // Not saved yet: the buffer of the page has them, too.
    scope.follow = false
    scope.triggered = cycle
    scope.show(...range)
  }

  /** Files of the samples: written by the program. */
  async leaveAs(kind: Kind, what: 'visible' | 'cursors' | 'all') {
    this.panel = ''
    const { span } = await import('./files')
    const part = span(what)
    if (!part || part[1] < part[0]) return this.#refuse(what)
    await captures.leave(kind, part)
  }

  async leave(kind: 'svg' | 'png' | 'visible' | 'cursors' | 'all') {
    this.panel = ''
    const [{ figures, span, table }, { raster, stacked }] = await Promise.all([import('./files'), import('../plot/export')])
    if (kind === 'svg' || kind === 'png') {
      const all = figures()
      if (!all.length) return bench.warn('No signals in the panes')
      const text = stacked(all)
      if (kind === 'svg') return save('scope.svg', 'image/svg+xml', text)
      const [, width, height] = /width="(\d+)" height="(\d+)"/.exec(text)!
      return save('scope.png', 'image/png', await raster(text, Number(width), Number(height)))
    }
    const part = span(kind)
    if (!part || part[1] < part[0]) return this.#refuse(kind)
    save('scope.csv', 'text/csv', table(part))
  }

  #refuse(what: string) {
    bench.warn(what === 'cursors' ? 'Set both cursors first: A and B' : 'This range is older than the buffer of single cycles')
  }

  /** At the pointer; otherwise in the middle of the view. */
  #at(): number {
    return scope.pointer?.cycle ?? (scope.view.from + scope.view.to) / 2
  }

  #commands(): Command[] {
    return [
      { name: 'Scope: hold or resume', key: 'Space', run: () => scope.hold() },
      { name: 'Scope: cursor A at the pointer', key: 'A', run: () => scope.put('a', this.#at()) },
      { name: 'Scope: cursor B at the pointer', key: 'B', run: () => scope.put('b', this.#at()) },
      { name: 'Scope: remove cursors', key: '', run: () => (scope.cursors = { a: null, b: null }) },
      { name: 'Scope: trigger level at the pointer', key: 'T', run: () => this.#level(), off: () => (scope.pointer ? null : 'Move the pointer over a pane') },
      { name: 'Scope: show all', key: '0', run: () => scope.all() },
      { name: 'Scope: show the history of the program', key: '', run: () => scope.showHistory() },
      { name: 'Scope: previous view', key: '[', run: () => scope.back() },
      { name: 'Scope: next view', key: ']', run: () => scope.forth() },
      { name: 'Scope: export', key: 'E', run: () => (this.panel = this.panel === 'export' ? '' : 'export') },
      { name: 'Scope: new time pane', key: '', run: () => scope.addPane('time') },
      { name: 'Scope: new XY pane', key: '', run: () => scope.addPane('xy') },
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
    const [frames, drawing, start] = [scope.frames, scope.drawing, performance.now()]
    await new Promise((resolve) => setTimeout(resolve, 2000))
    const count = scope.frames - frames
    if (!count) return bench.notify('The scope is closed')
    const rate = (1000 * count) / (performance.now() - start)
    bench.notify(`Scope: ${rate.toFixed(0)} frames per second, ${((scope.drawing - drawing) / count).toFixed(1)} ms each`)
  }
}

export const dock = new Dock()
