// The displayed part of the samples: views, their history, zoom, cursors.

import { Layout } from './layout.svelte'
import type { Ring } from './ring'

/** Shortest span of a view [cycles]. */
export const SHORTEST = 4
/** Views that can be restored. */
const MOST = 50

export type View = { from: number; to: number }
export type CursorName = 'a' | 'b'
type Past = { view: View; follow: boolean; ranges: [number, [number, number] | null][] }

export abstract class Views extends Layout {
  /** Length of the view [s]. */
  span = $state(10)
  /** The view [cycles]. */
  view: View = { from: 0, to: 1 }
  /** Pointer position over a pane. */
  pointer: { pane: number; cycle: number; value: number } | null = null
  #past: Past[] = []
  #future: Past[] = []
  #pushed = 0

  /** Shows saved samples instead of the live ones, until the display is resumed. */
  showCapture(capture: { run: number; name: string }, ring: Ring, rate: number, trigger: number | null) {
    this.follow = false
    this.ring = ring
    this.rate = rate
    this.capture = capture
    this.length = (ring.next - ring.first) / rate
    this.triggered = trigger
    this.cursors = { a: null, b: null }
    this.derive()
    this.show(ring.first, ring.next)
  }

  /** Requests the part of the history that the view needs; live, only how far it reaches. */
  protected askHistory() {
    const { ring, view, history } = this
    if (!ring || this.capture || ring.next < 0) return
    if (this.follow) history.look(ring, this.shown())
    else if (view.from < ring.first) history.near(ring, view, this.shown())
  }

  seconds(cycles: number): number {
    return cycles / (this.rate || 1)
  }

  /** Displayed time of a cycle: since the trigger, or since the start of the bench [s]. */
  time(cycle: number): number {
    return this.seconds(cycle - (this.triggered ?? 0))
  }

  #state(): Past {
    return { view: { ...this.view }, follow: this.follow, ranges: this.panes.map((pane) => [pane.id, pane.range]) }
  }

  /** Stores the view before a change; many small steps count as one. */
  remember(apart = 0) {
    if (performance.now() - this.#pushed < apart) return
    this.#pushed = performance.now()
    this.#past = [...this.#past.slice(1 - MOST), this.#state()]
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
    const room = !ring ? to - from : this.follow || ring.next < 0 ? ring.room : Math.max(ring.room, ring.next - this.oldest)
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

  put(which: CursorName, cycle: number) {
    const { ring } = this
    if (!ring || ring.next < 0) return
    this.cursors[which] = Math.round(Math.min(Math.max(cycle, this.follow ? ring.first : this.oldest), ring.next - 1))
  }
}
