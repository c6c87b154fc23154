// Level crossings of a signal, sample by sample.

import type { Ring } from './ring'

export type Slope = 'rising' | 'falling' | 'either'

/** The first cycle in `from` … `to` at which the signal has crossed a level; `null`: none. */
export function crossing(ring: Ring, signal: number, from: number, to: number, level: number, slope: Slope): number | null {
  const column = ring.columns[signal]
  const start = Math.max(Math.ceil(from), ring.first + 1)
  if (!column || start >= to) return null
  let before = column[(start - 1) % ring.room]!
  for (let cycle = start; cycle < to; cycle++) {
    const value = column[cycle % ring.room]!
    const rises = before < level && value >= level
    const falls = before > level && value <= level
    if ((rises && slope !== 'falling') || (falls && slope !== 'rising')) return cycle
    before = value
  }
  return null
}
