// Samples as the program stores them: description, numbers of the cycles, values of each signal in turn.

import type { Signal } from '../protocol'
import { Ring } from './ring'

type Described = { name: string; unit: string; help?: string }
export type Samples = { rate: number; trigger: number | null; signals: Described[]; cycles: Float64Array; columns: Float64Array[] }

/** The cycles from `from` to `to` of some signals, by index, as a body of a request; `null` without cycles. */
export function packed(ring: Ring, signals: { signal: Signal; index: number }[], from: number, to: number, rate: number, trigger: number | null): Blob | null {
  const cycles: number[] = []
  let gap = 0
  for (let cycle = Math.max(ring.first, Math.ceil(from)); cycle <= Math.min(ring.next - 1, Math.floor(to)); cycle++) {
    while (ring.gaps[gap] && ring.gaps[gap]!.from + ring.gaps[gap]!.cycles <= cycle) gap += 1
    const missing = ring.gaps[gap]
    if (!missing || cycle < missing.from) cycles.push(cycle)
  }
  if (!cycles.length) return null
  const described = signals.map(({ signal: { name, unit, help } }) => ({ name, unit, help }))
  const head = new TextEncoder().encode(JSON.stringify({ rate, trigger, signals: described }))
  const length = Math.ceil((head.length + 4) / 8) * 8 - 4
  const padded = new Uint8Array(4 + length).fill(32)
  new DataView(padded.buffer).setUint32(0, length, true)
  padded.set(head, 4)
  const columns = signals.map(({ index }) => Float64Array.from(cycles, (cycle) => ring.value(index, cycle)))
  return new Blob([padded, Float64Array.from(cycles), ...columns])
}

/** Samples of an answer. */
export function unpacked(buffer: ArrayBuffer): Samples {
  const length = new DataView(buffer).getUint32(0, true)
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length))) as Pick<Samples, 'rate' | 'trigger' | 'signals'>
  const numbers = new Float64Array(buffer, 4 + length)
  const rows = numbers.length / (head.signals.length + 1)
  const column = (n: number) => numbers.subarray(n * rows, (n + 1) * rows)
  return { ...head, cycles: column(0), columns: head.signals.map((_, n) => column(n + 1)) }
}

/** A ring with these samples for the signals of the scope; those that are missing have no values. */
export function ringOf({ rate, signals, cycles, columns }: Samples, streamed: Signal[]): Ring {
  const span = cycles.at(-1)! - cycles[0]! + 1
  // A multiple of the block, with room for a start within a block.
  const ring = new Ring(streamed.length, rate, Infinity, span + 32)
  const places = streamed.map((signal) => signals.findIndex((one) => one.name === signal.name))
  for (let row = 0; row < cycles.length; ) {
    let rows = 1
    while (row + rows < cycles.length && cycles[row + rows] === cycles[row]! + rows) rows += 1
    const values = new Float64Array(rows * streamed.length)
    places.forEach((place, n) => {
      if (place < 0) values.fill(NaN, n * rows, (n + 1) * rows)
      else values.set(columns[place]!.subarray(row, row + rows), n * rows)
    })
    ring.write({ stream: 0, from: cycles[row]!, missing: 0, rows, values })
    row += rows
  }
  return ring
}
