// The samples of the scope: the stream of the program, the ring that is displayed, and Hold. Samples go directly into the
// ring, not through reactive state.

import { bench, stored } from '../bench.svelte'
import { Connection, Refused } from '../connection'
import type { Mark, Signal } from '../protocol'
import { frame } from './frames'
import { History } from './history.svelte'
import { Ring } from './ring'

/** Maximum number of streamed signals: the limit of the program. */
const WIDEST = 64
export const STORAGE = 'stickslip.scope'

export abstract class Source {
  rate = $state(0)
  /** Length of the buffer [s]. */
  length = $state(0)
  online = $state(false)
  marks = $state.raw<Mark[]>([])
  cursors = $state<{ a: number | null; b: number | null }>({ a: null, b: null })
  /** The cycle of the displayed event. */
  triggered = $state<number | null>(null)
  /** The displayed capture. */
  capture = $state.raw<{ run: number; name: string } | null>(null)
  /** Signals of the program. */
  streamed: Signal[] = []
  /** The displayed data: those of `live`, or on hold those of its start, or of a capture. */
  ring: Ring | null = null
  /** Receives every cycle. */
  live: Ring | null = null
  /** The history of the program. */
  readonly history = new History((call) => this.connection?.call(call, 'past') ?? Promise.reject(new Refused('The bench is not connected.')))
  protected connection: Connection | null = null
  /** Up to here, events have been searched. */
  protected scanned = 0
  /** True if the view follows the newest cycle; otherwise the data are held, too. */
  #follow = $state(true)
  /** The ring of the start of the hold, and the tick rate of the bench. */
  #held: Ring | null = null
  #liveRate = 0
  #stream = -1

  /** Computes the channels in all rings. */
  protected abstract derive(): void
  /** Signals in the panes that the program has: their indices and names. */
  protected abstract shown(): [number, string][]
  /** The signals are known; `panes` are the default ones, `layout` that of the browser or of the project. */
  protected abstract opened(panes: string[][], layout: string): void

  /** The rings that are in use. */
  protected get rings(): Ring[] {
    const all = [this.ring, this.live, this.#held]
    return all.filter((ring, at): ring is Ring => ring !== null && all.indexOf(ring) === at)
  }

  /** Connects to the bench, once. */
  start() {
    if (this.connection) return
    const connection = new Connection(() => bench.name)
    this.connection = connection
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
        this.streamed = signals
        this.#liveRate = status.rate
        this.follow = true
        this.#restart()
        // A browser without a layout gets that of the project.
        const text = stored(STORAGE, '') || (await connection.call({ call: 'layout' }, 'text').catch(() => ({ text: '' }))).text
        this.opened(offer.panes, text)
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
    this.scanned = 0
    this.history.restart()
    if (!this.#follow) return this.derive()
    this.ring = this.live
    this.rate = this.#liveRate
    this.derive()
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
    this.derive()
    // The whole history, so that it is there as long as the display is held.
    this.history.whole(live, this.shown())
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
    this.derive()
    if (this.ring) this.length = this.ring.room / this.rate
    // A cursor outside the data is removed.
    const { a, b } = this.cursors
    const there = (cycle: number | null) => (cycle !== null && this.ring && cycle >= this.ring.first && cycle < this.ring.next ? cycle : null)
    this.cursors = { a: there(a), b: there(b) }
    this.scanned = this.live?.next ?? 0
  }

  /** The oldest cycle that can be displayed. */
  get oldest(): number {
    const { ring } = this
    if (!ring || ring.next < 0 || this.capture) return ring?.first ?? 0
    return Math.min(ring.first, this.history.oldest(this.#follow) ?? ring.first)
  }

  async askMarks() {
    if (!this.connection?.open) return
    try {
      this.marks = (await this.connection.call({ call: 'marks' }, 'marks')).marks
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    }
  }
}
