// The newest cycles of all signals in constant memory, and their extremes in any span.

import type { Step } from './formula'
import type { Frame } from './frames'
import type { Chunk } from './past'

/** Cycles per block with stored extremes. */
const BLOCK = 16
/** Memory of the device as far as the browser states it [GB]; 4 if it does not. */
const device = (globalThis.navigator as { deviceMemory?: number } | undefined)?.deviceMemory ?? 4
/** Memory for all signals [bytes]: less on a phone. */
const BUDGET = Math.min(200e6, 100e6 * device)
/** Cycles that are copied at once. */
const COPY = 4096
/** Length of the buffer if it fits into the memory [s]. */
const LONGEST = 60

/** Missing cycles. */
export type Gap = { from: number; cycles: number }
export type Statistics = { count: number; mean: number; rms: number; least: number; largest: number }

export class Ring {
  /** Capacity in cycles, a multiple of the block. */
  readonly room: number
  /** The first received cycle, and the cycle after the newest. */
  origin = -1
  next = -1
  delivered = 0
  missing = 0
  gaps: Gap[] = []
  /** Parts of the program's history before the oldest cycle: near the view, and all of it. */
  past: Chunk[] = []
  readonly columns: Float64Array[]
  readonly signals: number
  /** Formulas of the computed columns. */
  #formulas: { start: () => Step; step: Step }[] = []
  #least: Float64Array[]
  #largest: Float64Array[]

  constructor(signals: number, rate: number, budget = BUDGET, most = LONGEST * rate) {
    this.signals = signals
    const bytes = signals * 8 * (1 + 2 / BLOCK)
    this.room = BLOCK * Math.max(1, Math.floor(Math.min(most, budget / bytes) / BLOCK))
    const arrays = (length: number) => Array.from({ length: signals }, () => new Float64Array(length))
    this.columns = arrays(this.room)
    this.#least = arrays(this.room / BLOCK)
    this.#largest = arrays(this.room / BLOCK)
  }

  /** The oldest stored cycle. */
  get first(): number {
    return Math.max(this.origin, this.next - this.room)
  }

  /** True if a frame continues the buffer; false after a restart of the bench. */
  fits(frame: Frame): boolean {
    return frame.values.length === frame.rows * this.signals && (this.next < 0 || frame.from >= this.next)
  }

  /** Sets the computed columns after those of the signals, in this order; each depends on signals only. */
  derive(all: (() => Step)[]) {
    for (const arrays of [this.columns, this.#least, this.#largest]) arrays.length = this.signals
    this.#formulas = all.map((start) => ({ start, step: start() }))
    all.forEach(() => {
      this.columns.push(new Float64Array(this.room))
      this.#least.push(new Float64Array(this.room / BLOCK))
      this.#largest.push(new Float64Array(this.room / BLOCK))
    })
    if (this.next < 0) return
    let missing = 0
    for (let cycle = this.first; cycle < this.next; ) {
      const gap = this.gaps.find((gap) => cycle < gap.from + gap.cycles && gap.from <= cycle)
      if (gap) missing = gap.from + gap.cycles
      const count = Math.min(this.next - cycle, BLOCK - (cycle % BLOCK))
      for (let i = 0; i < count; i++) this.#compute(cycle + i, 1, cycle + i < missing)
      cycle += count
    }
  }

  /** Computes the columns for cycles of one block. */
  #compute(cycle: number, count: number, missing = false) {
    const slot = cycle % this.room
    this.#formulas.forEach((formula, n) => {
      const column = this.columns[this.signals + n]!
      // Computation restarts after a gap.
      if (missing) formula.step = formula.start()
      for (let i = slot; i < slot + count; i++) column[i] = missing ? NaN : formula.step(this.columns, i)
      this.#extend(this.signals + n, cycle, column, slot, slot + count)
    })
  }

  /** Stores a frame that fits. */
  write(frame: Frame) {
    if (this.next < 0) this.origin = this.next = frame.from - frame.missing
    this.#leave(frame.from - this.next)
    const { rows, values } = frame
    for (let done = 0; done < rows; ) {
      const [cycle, slot] = [this.next, this.next % this.room]
      // Up to the end of a block, which is also the end of the ring.
      const count = Math.min(rows - done, BLOCK - (cycle % BLOCK))
      for (let signal = 0; signal < this.signals; signal++) {
        const column = this.columns[signal]!
        const [from, to] = [signal * rows + done, signal * rows + done + count]
        column.set(values.subarray(from, to), slot)
        this.#extend(signal, cycle, values, from, to)
      }
      this.#compute(cycle, count)
      this.next += count
      done += count
    }
    this.delivered += rows
    const first = this.first
    while (this.gaps.length && this.gaps[0]!.from + this.gaps[0]!.cycles <= first) this.gaps.shift()
  }

  /** Adds the newer cycles of another ring of the same signals; returns whether they continue this one. */
  append(other: Ring): boolean {
    if (other.next < 0 || this.next < 0 || other.first < this.next) return other.next < 0
    for (let cycle = other.first; cycle < other.next; ) {
      const gap = other.gaps.find((gap) => gap.from <= cycle && cycle < gap.from + gap.cycles)
      if (gap) {
        cycle = gap.from + gap.cycles
        continue
      }
      const before = other.gaps.find((gap) => gap.from > cycle)?.from ?? other.next
      const rows = Math.min(before - cycle, other.room - (cycle % other.room), COPY)
      const values = new Float64Array(rows * this.signals)
      const slot = cycle % other.room
      for (let signal = 0; signal < this.signals; signal++) values.set(other.columns[signal]!.subarray(slot, slot + rows), signal * rows)
      this.write({ stream: 0, from: cycle, missing: 0, rows, values })
      cycle += rows
    }
    return true
  }

  #extend(signal: number, cycle: number, values: Float64Array, from: number, to: number) {
    const block = Math.floor((cycle % this.room) / BLOCK)
    const fresh = cycle % BLOCK === 0 || cycle === this.origin
    let low = fresh ? Infinity : this.#least[signal]![block]!
    let high = fresh ? -Infinity : this.#largest[signal]![block]!
    for (let i = from; i < to; i++) {
      const value = values[i]!
      if (value < low) low = value
      if (value > high) high = value
    }
    this.#least[signal]![block] = low
    this.#largest[signal]![block] = high
  }

  /** Stores a gap. */
  #leave(count: number) {
    if (count <= 0) return
    this.missing += count
    for (const formula of this.#formulas) formula.step = formula.start()
    this.gaps.push({ from: this.next, cycles: count })
    const from = Math.max(this.next, this.next + count - this.room)
    for (let cycle = from; cycle < this.next + count; cycle++) {
      const fresh = cycle % BLOCK === 0 || cycle === from
      const [slot, block] = [cycle % this.room, Math.floor((cycle % this.room) / BLOCK)]
      for (let signal = 0; signal < this.columns.length; signal++) {
        this.columns[signal]![slot] = NaN
        if (fresh && (cycle % BLOCK === 0 || this.next === this.origin)) {
          this.#least[signal]![block] = Infinity
          this.#largest[signal]![block] = -Infinity
        }
      }
    }
    this.next += count
  }

  /** A value; NaN if missing. */
  value(signal: number, cycle: number): number {
    return cycle >= this.first && cycle < this.next ? this.columns[signal]![cycle % this.room]! : NaN
  }

  /** Extremes of `count` spans of `step` cycles each; NaN for empty spans. */
  extremes(signal: number, from: number, step: number, count: number, low: Float64Array, high: Float64Array) {
    const [column, least, largest] = [this.columns[signal]!, this.#least[signal]!, this.#largest[signal]!]
    const [first, next, room] = [this.first, this.next, this.room]
    for (let i = 0; i < count; i++) {
      let cycle = Math.max(first, Math.ceil(from + i * step))
      const end = Math.min(next, Math.ceil(from + (i + 1) * step))
      let [a, b] = [Infinity, -Infinity]
      if (from + i * step < first) {
        const [start, stop] = [from + i * step, Math.min(first, from + (i + 1) * step)]
        for (const chunk of this.past) {
          if (!chunk.has(signal) || chunk.from > start + chunk.block || chunk.to < stop - chunk.block) continue
          const found = chunk.extremes(signal, start, stop)
          if (found) [a, b] = found
          break
        }
      }
      while (cycle < end) {
        const slot = cycle % room
        // A block that starts before the oldest cycle is partly overwritten with newer cycles.
        if (slot % BLOCK === 0 && cycle + BLOCK <= end) {
          const block = slot / BLOCK
          if (least[block]! < a) a = least[block]!
          if (largest[block]! > b) b = largest[block]!
          cycle += BLOCK
          continue
        }
        const value = column[slot]!
        if (value < a) a = value
        if (value > b) b = value
        cycle += 1
      }
      low[i] = a <= b ? a : NaN
      high[i] = a <= b ? b : NaN
    }
  }

  /** Statistics of the cycles from `from` to `to`, both included. */
  statistics(signal: number, from: number, to: number): Statistics {
    const column = this.columns[signal]!
    let [count, sum, squares, least, largest] = [0, 0, 0, Infinity, -Infinity]
    // Of older cycles only extremes are available.
    if (from < this.first && this.past.length) to = from - 1
    // Relative to the first value, so that a large mean costs no precision.
    let origin = NaN
    for (let cycle = Math.max(this.first, from); cycle <= Math.min(this.next - 1, to); cycle++) {
      const value = column[cycle % this.room]!
      if (Number.isNaN(value)) continue
      if (Number.isNaN(origin)) origin = value
      const apart = value - origin
      count += 1
      sum += apart
      squares += apart * apart
      if (value < least) least = value
      if (value > largest) largest = value
    }
    if (!count) return { count, mean: NaN, rms: NaN, least: NaN, largest: NaN }
    const shift = sum / count
    const mean = origin + shift
    return { count, mean, rms: Math.sqrt(Math.max(0, squares / count - shift * shift + mean * mean)), least, largest }
  }
}
