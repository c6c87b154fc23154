// When a signal passes a level, sample by sample.

import type { Ring } from './ring'

export type Slope = 'rising' | 'falling' | 'either'

/** The first cycle in `from` … `to` with which a signal has passed a level; `null`: none. */
export function crossing(ring: Ring, signal: number, from: number, to: number, level: number, slope: Slope): number | null {
  const column = ring.columns[signal]
  const begin = Math.max(Math.ceil(from), ring.first + 1)
  if (!column || begin >= to) return null
  let before = column[(begin - 1) % ring.room]!
  for (let cycle = begin; cycle < to; cycle++) {
    const value = column[cycle % ring.room]!
    const rises = before < level && value >= level
    const falls = before > level && value <= level
    if ((rises && slope !== 'falling') || (falls && slope !== 'rising')) return cycle
    before = value
  }
  return null
}
