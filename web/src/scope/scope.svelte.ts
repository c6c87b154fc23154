// State of the scope: signals in panes with a common time axis. Samples go directly into the ring, not through reactive state.

import { bench, store, stored } from '../bench.svelte'
import { significant } from '../format'
import { Connection, Refused } from '../connection'
import type { Mark, MarkKind, Signal } from '../protocol'
import { type Formula, read, Unreadable } from './formula'
import { frame } from './frames'
import { History } from './history.svelte'
import { Ring } from './ring'
import { crossing, type Slope } from './trigger'

/** Maximum number of streamed signals: the limit of the program. */
const WIDEST = 64
const STORAGE = 'stickslip.scope'
/** Interval between two updates of the displayed values [ms]. */
const READ = 100
/** Delay after which a changed layout is stored in the project [ms]. */
const LAYOUT = 1500
/** Shortest span of a view [cycles]. */
const SHORTEST = 4

export type Trace = { name: string; hidden: boolean }
export type Pane = { id: number; kind: 'time' | 'xy' | 'spectrum'; traces: Trace[]; range: [number, number] | null }
export type View = { from: number; to: number }
export type Mode = 'off' | 'auto' | 'normal' | 'single'
export type CursorName = 'a' | 'b'
/** Trigger event: a level crossing of a signal, or an event on the bench. */
export type Event = Slope | MarkKind
/** A computed channel: name, formula and unit. */
export type Channel = { name: string; text: string; unit: string }
type Past = { view: View; follow: boolean; ranges: [number, [number, number] | null][] }

class Scope {
  /** Signals of the program, then computed channels. */
  signals = $state.raw<Signal[]>([])
  channels = $state.raw<Channel[]>([])
  panes = $state<Pane[]>([])
  active = $state(0)
  /** True if the view follows the newest cycle; otherwise the data are held, too. */
  #follow = $state(true)
  /** Length of the view [s]. */
  span = $state(10)
  cursors = $state<{ a: number | null; b: number | null }>({ a: null, b: null })
  trigger = $state<{ mode: Mode; signal: string; level: number; slope: Event; before: number }>({ mode: 'off', signal: '', level: 0, slope: 'rising', before: 0.2 })
  /** The cycle of the displayed event. */
  /** The displayed value axis of each pane, for exports. */
  displayed = new Map<number, [number, number]>()
  triggered = $state<number | null>(null)
  marks = $state.raw<Mark[]>([])
  /** Increases ten times per second while the scope is drawn. */
  read = $state(0)
  rate = $state(0)
  /** Length of the buffer [s]. */
  length = $state(0)
  online = $state(false)
  /** The displayed data: those of `live`, or on hold those of its start, or of a capture. */
  ring: Ring | null = null
  /** Receives every cycle. */
  live: Ring | null = null
  /** The displayed capture. */
  capture = $state.raw<{ run: number; name: string } | null>(null)
  /** The history of the program. */
  readonly history = new History((call) => this.#connection?.call(call, 'past') ?? Promise.reject(new Refused('The bench is not connected.')))
  /** The view [cycles]. */
  view: View = { from: 0, to: 1 }
  /** Pointer position over a pane. */
  pointer: { pane: number; cycle: number; value: number } | null = null
  /** Drawn frames and the time spent on them [ms]. */
  frames = 0
  drawing = 0
  /** Signals of the program. */
  streamed: Signal[] = []
  /** The ring of the start of the hold, and the tick rate of the bench. */
  #held: Ring | null = null
  #liveRate = 0
  #layout = 0
  #connection: Connection | null = null
  #stream = -1
  #drawers = new Set<() => void>()
  #next = 0
  #lastRead = 0
  #scanned = 0
  #past: Past[] = []
  #future: Past[] = []
  #pushed = 0
  #pane = 0

  /** Connects to the bench, once. */
  start() {
    if (this.#connection) return
    const connection = new Connection(() => bench.name)
    this.#connection = connection
    connection.onchange = (online) => {
      this.online = online
      if (online) void this.#open(connection)
    }
    connection.onsamples = (buffer) => this.#receive(buffer)
    connection.connect()
  }

  async #open(connection: Connection) {
    try {
      const [status, offer] = await Promise.all([connection.call({ call: 'status' }, 'status'), connection.call({ call: 'signals' }, 'signals')])
      const signals = offer.signals.slice(0, WIDEST)
      const names = (all: Signal[]) => all.map((signal) => signal.name).join()
      if (!this.live || names(signals) !== names(this.streamed) || status.rate !== this.#liveRate) {
        this.streamed = this.signals = signals
        this.#liveRate = status.rate
        this.follow = true
        this.#restart()
        // A browser without a layout gets that of the project.
        const text = stored(STORAGE, '') || (await connection.call({ call: 'layout' }, 'text').catch(() => ({ text: '' }))).text
        if (!this.panes.length) this.#restore(offer.panes, text)
      }
      this.#stream = (await connection.call({ call: 'samples', signals: signals.map((signal) => signal.name) }, 'samples')).capture
      await this.askMarks()
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(`Scope: ${error.message}`)
    }
  }

  /** Starts with an empty buffer; held data stay. */
  #restart() {
    this.live = new Ring(this.streamed.length, this.#liveRate)
    this.#scanned = 0
    this.history.restart()
    if (!this.#follow) return this.#derive()
    this.ring = this.live
    this.rate = this.#liveRate
    this.#derive()
    this.length = this.live.room / this.rate
    this.triggered = null
    this.cursors = { a: null, b: null }
  }

  #receive(buffer: ArrayBuffer) {
    const message = frame(buffer)
    if (!this.live || message.stream !== this.#stream) return
    // A restarted bench counts its cycles from zero.
    if (!this.live.fits(message)) this.#restart()
    this.live.write(message)
  }

  // Hold: the displayed data stay, and another buffer receives the new cycles.

  get follow(): boolean {
    return this.#follow
  }

  set follow(on: boolean) {
    if (on === this.#follow) return
    this.#follow = on
    if (on) this.#release()
    else this.#freeze()
  }

  #freeze() {
    const { live } = this
    if (!live) return
    this.#held = live
    this.live = new Ring(live.signals, this.#liveRate)
    this.#derive()
    // The whole history, so that it is there as long as the display is held.
    this.history.whole(live, this.#shown())
  }

  #release() {
    const [held, live] = [this.#held, this.live]
    this.#held = null
    this.history.release()
    if (this.capture) this.triggered = null
    if (held && live) {
      held.past = []
      // After a long hold, or a restart of the bench, only the newest cycles are left.
      const continues = live.next < 0 || live.first === held.next
      if (continues && held.append(live)) this.live = held
    }
    this.ring = this.live
    this.capture = null
    this.rate = this.#liveRate
    this.#derive()
    if (this.ring) this.length = this.ring.room / this.rate
    // A cursor outside the data is removed.
    const { a, b } = this.cursors
    const there = (cycle: number | null) => (cycle !== null && this.ring && cycle >= this.ring.first && cycle < this.ring.next ? cycle : null)
    this.cursors = { a: there(a), b: there(b) }
    this.#scanned = this.live?.next ?? 0
  }

  /** Shows saved samples instead of the live ones, until the display is resumed. */
  showCapture(capture: { run: number; name: string }, ring: Ring, rate: number, trigger: number | null) {
    this.follow = false
    this.ring = ring
    this.rate = rate
    this.capture = capture
    this.length = (ring.next - ring.first) / rate
    this.triggered = trigger
    this.cursors = { a: null, b: null }
    this.#derive()
    this.show(ring.first, ring.next)
  }

  /** The oldest cycle that can be displayed. */
  get oldest(): number {
    const { ring } = this
    if (!ring || ring.next < 0 || this.capture) return ring?.first ?? 0
    return Math.min(ring.first, this.history.oldest(this.#follow) ?? ring.first)
  }

  /** Requests the part of the history that the view needs; live, only how far it reaches. */
  #askHistory() {
    const { ring, view, history } = this
    if (!ring || this.capture || ring.next < 0) return
    if (this.#follow) history.look(ring, this.#shown())
    else if (view.from < ring.first) history.near(ring, view, this.#shown())
  }

  /** Signals in the panes that the program has: their indices and names. */
  #shown(): [number, string][] {
    const indices = new Set(this.panes.flatMap((pane) => pane.traces.map((trace) => this.index(trace.name))))
    return [...indices].flatMap((index): [number, string][] => (index >= 0 && index < this.streamed.length ? [[index, this.streamed[index]!.name]] : []))
  }

  async askMarks() {
    if (!this.#connection?.open) return
    try {
      this.marks = (await this.#connection.call({ call: 'marks' }, 'marks')).marks
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    }
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
    this.#derive()
    this.add(name)
  }

  removeChannel(name: string) {
    this.channels = this.channels.filter((channel) => channel.name !== name)
    for (const pane of [...this.panes]) this.remove(pane.id, name)
    this.#derive()
    this.keep()
  }

  isComputed(name: string): boolean {
    return this.index(name) >= this.streamed.length
  }

  #derive() {
    const usable: { channel: Channel; formula: Formula }[] = []
    for (const channel of this.channels) {
      try {
        usable.push({ channel, formula: this.formula(channel.text) })
      } catch {
        // This bench does not have the signals; another one may.
      }
    }
    for (const ring of new Set([this.ring, this.live, this.#held])) ring?.derive(usable.map(({ formula }) => formula.start))
    const computed = usable.map(({ channel: { name, text, unit } }) => ({ name, label: name, symbol: '', unit, printed_unit: unit, help: `Computed: ${text}.`, values: [] }))
    this.signals = [...this.streamed, ...computed]
  }

  index(name: string): number {
    return this.signals.findIndex((signal) => signal.name === name)
  }

  seconds(cycles: number): number {
    return cycles / (this.rate || 1)
  }

  /** Displayed time of a cycle: since the trigger, or since the start of the bench [s]. */
  time(cycle: number): number {
    return this.seconds(cycle - (this.triggered ?? 0))
  }

  // Drawing.

  /** Calls `drawer` for each frame until the returned function is called. */
  draws(drawer: () => void): () => void {
    this.#drawers.add(drawer)
    if (this.#drawers.size === 1) this.#next = requestAnimationFrame(this.#tick)
    return () => {
      this.#drawers.delete(drawer)
      if (!this.#drawers.size) cancelAnimationFrame(this.#next)
    }
  }

  #tick = (now: number) => {
    this.#next = requestAnimationFrame(this.#tick)
    const start = performance.now()
    this.#advance()
    this.#askHistory()
    for (const drawer of this.#drawers) drawer()
    this.frames += 1
    this.drawing += performance.now() - start
    if (now - this.#lastRead > READ) {
      this.#lastRead = now
      this.read += 1
    }
  }

  #advance() {
    const { ring, trigger } = this
    if (!ring || ring.next < 0 || !this.follow) return
    const span = Math.max(SHORTEST, this.span * this.rate)
    const { slope } = trigger
    const passes = slope === 'rising' || slope === 'falling' || slope === 'either'
    if (trigger.mode === 'off' || (passes && this.index(trigger.signal) < 0)) {
      this.triggered = null
      return this.#setView(ring.next - span, ring.next)
    }
    const behind = (1 - trigger.before) * span
    const from = Math.max(this.#scanned, ring.first + Math.floor(trigger.before * span))
    const event = passes ? crossing(ring, this.index(trigger.signal), from, ring.next, trigger.level, slope) : this.#firstMark(slope, from)
    if (event === null) {
      // Marks arrive later than the samples of their cycle.
      if (passes) this.#scanned = Math.max(from, ring.next - 1)
      const silent = ring.next - (this.triggered ?? 0) > Math.max(2 * span, this.rate / 2)
      if (trigger.mode === 'auto' && silent) this.triggered = null
      // An event that has left the memory cannot be shown.
      if (this.view.to <= ring.first) this.triggered = null
      // Live until the first event.
      if (this.triggered === null) this.#setView(ring.next - span, ring.next)
      return
    }
    this.#scanned = event
    // Waits for the samples after the event.
    if (ring.next < event + behind) return
    this.triggered = event
    this.#scanned = Math.ceil(event + behind)
    this.#setView(event - trigger.before * span, event + behind)
    if (trigger.mode !== 'single') return
    this.follow = false
    const condition = passes ? `${trigger.signal} ${slope === 'either' ? 'crosses' : slope === 'rising' ? 'rises through' : 'falls through'} ${significant(trigger.level, 3)}` : slope
    void import('./captures.svelte').then(({ captures }) => captures.save(`single shot, ${condition}`, this.view.from, this.view.to, event))
  }

  /** The first cycle from `from` with a mark of a kind. */
  #firstMark(kind: MarkKind, from: number): number | null {
    const cycles = this.marks.filter((mark) => mark.kind === kind && mark.cycle >= from).map((mark) => mark.cycle)
    return cycles.length ? Math.min(...cycles) : null
  }

  #setView(from: number, to: number) {
    this.view = { from, to }
  }

  /** Searches for events from now on. */
  arm(mode: Mode) {
    this.trigger.mode = mode
    this.#scanned = this.ring?.next ?? 0
    this.follow = true
    this.triggered = null
    this.keep()
  }

  // Views.

  #state(): Past {
    return { view: { ...this.view }, follow: this.follow, ranges: this.panes.map((pane) => [pane.id, pane.range]) }
  }

  /** Stores the view before a change; many small steps count as one. */
  remember(apart = 0) {
    if (performance.now() - this.#pushed < apart) return
    this.#pushed = performance.now()
    this.#past = [...this.#past.slice(-49), this.#state()]
    this.#future = []
  }

  back() {
    const past = this.#past.pop()
    if (!past) return
    this.#future.push(this.#state())
    this.#restoreView(past)
  }

  forth() {
    const past = this.#future.pop()
    if (!past) return
    this.#past.push(this.#state())
    this.#restoreView(past)
  }

  #restoreView({ view, follow, ranges }: Past) {
    this.follow = follow
    this.show(view.from, view.to)
    for (const [id, range] of ranges) {
      const pane = this.panes.find((pane) => pane.id === id)
      if (pane) pane.range = range
    }
  }

  /** Shows a range; in live display, only its length applies. */
  show(from: number, to: number) {
    const { ring } = this
    const room = !ring ? to - from : this.#follow || ring.next < 0 ? ring.room : Math.max(ring.room, ring.next - this.oldest)
    const span = Math.min(Math.max(to - from, SHORTEST), room)
    const middle = (from + to) / 2
    this.view = { from: middle - span / 2, to: middle + span / 2 }
    this.span = this.seconds(span)
    this.keep()
  }

  zoom(cycle: number, factor: number) {
    this.remember(600)
    const { from, to } = this.view
    this.show(cycle - (cycle - from) * factor, cycle + (to - cycle) * factor)
  }

  pan(cycles: number) {
    this.follow = false
    this.show(this.view.from + cycles, this.view.to + cycles)
  }

  /** Shows all data. */
  all() {
    this.remember()
    for (const pane of this.panes) pane.range = null
    const { ring } = this
    if (ring && ring.next >= 0) this.show(Math.min(ring.first, ring.next - SHORTEST), ring.next)
  }

  /** Holds the display and shows all of the history of the program. */
  showHistory() {
    const { ring } = this
    if (!ring || ring.next < 0) return
    this.remember()
    this.follow = false
    this.show(this.oldest, ring.next)
  }

  hold() {
    this.follow = !this.follow
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

  // Cursors.

  put(which: CursorName, cycle: number) {
    const { ring } = this
    if (!ring || ring.next < 0) return
    this.cursors[which] = Math.round(Math.min(Math.max(cycle, this.#follow ? ring.first : this.oldest), ring.next - 1))
  }

  // Settings kept across reloads.

  keep() {
    const { panes, span, trigger, channels } = this
    const settings = { span, channels, trigger: { ...trigger, mode: trigger.mode === 'single' ? 'normal' : trigger.mode }, panes: panes.map(({ kind, traces }) => ({ kind, names: traces.map((trace) => trace.name) })) }
    const layout = JSON.stringify(settings)
    if (layout === stored(STORAGE, '')) return
    store(STORAGE, layout)
    clearTimeout(this.#layout)
    // That of the operator becomes the layout of the project.
    this.#layout = window.setTimeout(() => void this.#connection?.call({ call: 'keep_layout', layout }, 'done').catch(() => {}), LAYOUT)
  }

  /** Restores the panes of a layout, or the default panes of the program. */
  #restore(otherwise: string[][], layout: string) {
    let settings: { span?: number; channels?: Channel[]; trigger?: Partial<Scope['trigger']>; panes?: { kind: Pane['kind']; names: string[] }[] } = {}
    try {
      settings = JSON.parse(layout || '{}') as typeof settings
    } catch {
      // Unreadable settings are ignored.
    }
    this.channels = settings.channels ?? []
    this.#derive()
    for (const { kind, names } of settings.panes ?? otherwise.map((names) => ({ kind: 'time' as const, names }))) this.addPane(kind, names)
    if (settings.span! > 0) this.span = settings.span!
    this.trigger = { ...this.trigger, signal: otherwise[1]?.[0] ?? this.signals[0]?.name ?? '', ...settings.trigger }
    this.active = this.panes[0]?.id ?? 0
  }

  /** Restores the default panes. */
  async reset() {
    store(STORAGE, '{}')
    if (!this.#connection?.open) return
    const offer = await this.#connection.call({ call: 'signals' }, 'signals')
    this.panes = []
    this.#restore(offer.panes, '')
    this.keep()
  }
}

export const scope = new Scope()
