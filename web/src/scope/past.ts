// Extremes from the history of the program, for cycles that are older than the buffer of the page.

import type { Past } from '../protocol'

/** A part of the history: extremes of blocks, by the index of the signal. */
export class Chunk {
  readonly from: number
  readonly block: number
  readonly to: number
  readonly #low = new Map<number, (number | null)[]>()
  readonly #high = new Map<number, (number | null)[]>()

  constructor(signals: number[], { from, block, low, high }: Pick<Past, 'from' | 'block' | 'low' | 'high'>) {
    ;[this.from, this.block] = [from, block]
    this.to = from + block * (low[0]?.length ?? 0)
    signals.forEach((signal, n) => {
      this.#low.set(signal, low[n] ?? [])
      this.#high.set(signal, high[n] ?? [])
    })
  }

  has(signal: number): boolean {
    return this.#low.has(signal)
  }

  /** Extremes of the blocks that overlap a span; `null` if it is outside or has no values. */
  extremes(signal: number, from: number, to: number): [number, number] | null {
    const [low, high] = [this.#low.get(signal), this.#high.get(signal)]
    if (!low || !high || to <= this.from || from >= this.to) return null
    const start = Math.max(0, Math.floor((from - this.from) / this.block))
    const end = Math.min(low.length, Math.max(start + 1, Math.ceil((to - this.from) / this.block)))
    let [a, b] = [Infinity, -Infinity]
    for (let i = start; i < end; i++) {
      if (low[i] == null) continue
      a = Math.min(a, low[i]!)
      b = Math.max(b, high[i]!)
    }
    return a <= b ? [a, b] : null
  }
}
