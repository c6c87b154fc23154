// State of the scope: signals in panes with a common time axis, drawn frame by frame, and the trigger.

import { significant } from '../format'
import type { MarkKind } from '../protocol'
import { crossing, type Slope } from './trigger'
import { SHORTEST, Views } from './views.svelte'

export type { Channel, Pane, Trace } from './layout.svelte'
export type { CursorName, View } from './views.svelte'

/** Interval between two updates of the displayed values [ms]. */
const READ = 100

export type Mode = 'off' | 'auto' | 'normal' | 'single'
/** Trigger event: a level crossing of a signal, or an event on the bench. */
export type Event = Slope | MarkKind

class Scope extends Views {
  trigger = $state<{ mode: Mode; signal: string; level: number; slope: Event; before: number }>({ mode: 'off', signal: '', level: 0, slope: 'rising', before: 0.2 })
  /** Increases ten times per second while the scope is drawn. */
  read = $state(0)
  /** Drawn frames and the time spent on them [ms]. */
  frames = 0
  drawing = 0
  /** The displayed value axis of each pane, for exports. */
  displayed = new Map<number, [number, number]>()
  #drawers = new Set<() => void>()
  #next = 0
  #lastRead = 0

  protected get settings() {
    const { span, trigger } = this
    return { span, trigger: { ...trigger, mode: trigger.mode === 'single' ? 'normal' : trigger.mode } }
  }

  protected restoreSettings({ span, trigger }: { span?: number; trigger?: Partial<Scope['trigger']> }, panes: string[][]) {
    if (span! > 0) this.span = span!
    this.trigger = { ...this.trigger, ...trigger }
    if (this.index(this.trigger.signal) < 0) this.trigger.signal = panes[1]?.[0] ?? this.signals[0]?.name ?? ''
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
    this.askHistory()
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
    const from = Math.max(this.scanned, ring.first + Math.floor(trigger.before * span))
    const event = passes ? crossing(ring, this.index(trigger.signal), from, ring.next, trigger.level, slope) : this.#firstMark(slope, from)
    if (event === null) {
      // Marks arrive later than the samples of their cycle.
      if (passes) this.scanned = Math.max(from, ring.next - 1)
      const silent = ring.next - (this.triggered ?? 0) > Math.max(2 * span, this.rate / 2)
      if (trigger.mode === 'auto' && silent) this.triggered = null
      // An event that has left the memory cannot be shown.
      if (this.view.to <= ring.first) this.triggered = null
      // Live until the first event.
      if (this.triggered === null) this.#setView(ring.next - span, ring.next)
      return
    }
    this.scanned = event
    // Waits for the samples after the event.
    if (ring.next < event + behind) return
    this.triggered = event
    this.scanned = Math.ceil(event + behind)
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
    this.scanned = this.ring?.next ?? 0
    this.follow = true
    this.triggered = null
    this.keep()
  }
}

export const scope = new Scope()
