// Values of signals as text.

import { fixed, significant } from '../format'
import type { Signal } from '../protocol'

/** A live value with a fixed width. */
export function live(signal: Signal, value: number): string {
  if (Number.isNaN(value)) return '–'
  if (signal.values.length) return signal.values[Math.round(value)] ?? fixed(value, 0)
  const size = Math.abs(value)
  // Counts.
  if (size >= 1000 && Number.isInteger(value)) return fixed(value, 0)
  return fixed(value, size >= 1000 ? 1 : size >= 10 ? 2 : size >= 0.0995 || size === 0 ? 3 : 4)
}

/** A value at a cursor, with all digits. */
export function exact(value: number): string {
  return Number.isNaN(value) ? '–' : significant(value, 4)
}

/** A time with a suitable unit. */
export function time(seconds: number): string {
  const size = Math.abs(seconds)
  if (size >= 1 || size === 0) return `${fixed(seconds, 4)} s`
  if (size >= 1e-3) return `${fixed(seconds * 1e3, 2)} ms`
  return `${fixed(seconds * 1e6, 1)} µs`
}

export function duration(seconds: number): string {
  const size = Math.abs(seconds)
  if (size >= 0.9995) return `${significant(seconds, 4)} s`
  if (size >= 0.9995e-3) return `${significant(seconds * 1e3, 4)} ms`
  return `${significant(seconds * 1e6, 4)} µs`
}
