// The history of the program: how far it reaches, and its parts for a held display.

import { Refused } from '../connection'
import type { Call, Past } from '../protocol'
import { Chunk } from './past'
import type { Ring } from './ring'

/** Largest number of blocks of an answer. */
const POINTS = 2000
/** Intervals between two requests, on hold and live [ms]. */
const [HELD, LIVE] = [200, 5000]

type Shown = [index: number, name: string][]

export class History {
  /** Its oldest cycle, and the length of its finest blocks [cycles]. */
  reach = $state.raw<{ oldest: number; finest: number } | null>(null)
  /** All of it at the start of the hold: it stays, however long the hold is. */
  #whole: Chunk | null = null
  /** Increases with each hold and its end: later answers to earlier requests are ignored. */
  #hold = 0
  #asked = 0
  #last = ''
  #ask: (call: Extract<Call, { call: 'past' }>) => Promise<Past>

  constructor(ask: (call: Extract<Call, { call: 'past' }>) => Promise<Past>) {
    this.#ask = ask
  }

  /** The oldest cycle of the history, on hold of its part in the page. */
  oldest(live: boolean): number | null {
    return (live ? null : this.#whole?.from) ?? this.reach?.oldest ?? null
  }

  /** A restarted bench has another history. */
  restart() {
    this.reach = null
  }

  release() {
    this.#whole = null
    this.#last = ''
    this.#hold += 1
  }

  /** Only how far it reaches, seldom. */
  look(ring: Ring, shown: Shown) {
    if (performance.now() - this.#asked > LIVE) void this.#read(ring, ring.next - 1, ring.next, shown.slice(0, 1))
  }

  /** All of it, for a hold. */
  whole(ring: Ring, shown: Shown) {
    const hold = (this.#hold += 1)
    void this.#read(ring, 0, ring.first, shown).then((chunk) => {
      if (!chunk || hold !== this.#hold) return
      this.#whole = chunk
      ring.past = [chunk]
    })
  }

  /** The part near a view of a held display. */
  near(ring: Ring, { from, to }: { from: number; to: number }, shown: Shown) {
    if (performance.now() - this.#asked < HELD) return
    const margin = (to - from) / 2
    const part = [Math.max(0, Math.floor(from - margin)), Math.min(ring.first, Math.ceil(to + margin))] as const
    const request = [...part, shown].join()
    if (request === this.#last) return
    this.#last = request
    const hold = this.#hold
    void this.#read(ring, ...part, shown).then((chunk) => {
      if (chunk && hold === this.#hold) ring.past = this.#whole ? [chunk, this.#whole] : [chunk]
    })
  }

  async #read(ring: Ring, from: number, to: number, shown: Shown): Promise<Chunk | null> {
    this.#asked = performance.now()
    if (!shown.length) return null
    try {
      const past = await this.#ask({ call: 'past', signals: shown.map(([, name]) => name), from, to, points: POINTS })
      if (past.next < ring.first) return null
      this.reach = { oldest: past.oldest, finest: past.finest }
      return past.low[0]?.length ? new Chunk(shown.map(([index]) => index), past) : null
    } catch (error) {
      if (error instanceof Refused) return null
      throw error
    }
  }
}
