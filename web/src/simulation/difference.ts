// The difference of simulated and recorded signals, compared with a tolerance.

import type { Trace } from '../protocol'

/** Default tolerance: this share of the recorded range. */
const SHARE = 0.01

/** The default tolerance of a signal; 0 for one that does not change. */
export function defaultTolerance(trace: Trace): number {
  const known = trace.recorded.flat().filter((value): value is number => value !== null)
  return known.length ? SHARE * known.reduce((range, value) => [Math.min(range[0]!, value), Math.max(range[1]!, value)], [Infinity, -Infinity]).reduce((low, high) => high - low) : 0
}

/** Share of the time intervals in which the difference exceeds the tolerance, 0 … 1. */
export function shareOutside(trace: Trace, tolerance: number): number {
  const [least, largest] = trace.difference
  const known = least!.map((low, i) => [low, largest![i]] as const).filter((pair): pair is [number, number] => pair[0] !== null && pair[1] != null)
  return known.length ? known.filter(([low, high]) => Math.max(-low, high) > tolerance).length / known.length : 0
}

/** Time at which a set-point begins to change; null if it does not. */
export function begin(time: number[], setpoint: Trace | undefined): number | null {
  const [least, largest] = setpoint?.recorded ?? []
  const first = least?.[0]
  const at = least?.findIndex((low, i) => low !== null && largest![i] != null && (largest![i] !== low || low !== first)) ?? -1
  return at < 0 ? null : time[at]!
}
