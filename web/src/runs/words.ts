// How the catalogue's values are written.

import { clock, fixed, printed, significant } from '../format'
import type { KeyNumber, Run, Value } from '../protocol'

export function key(number: KeyNumber | null): string {
  return number ? `${significant(number.value)} ${printed(number.unit)}`.trim() : ''
}

/** As people say it: today by its hour, otherwise with its day. */
export function when(begun: string, now = new Date()): string {
  const date = new Date(begun)
  if (Number.isNaN(date.getTime())) return begun
  const time = date.toLocaleTimeString('en-GB', { hour: '2-digit', minute: '2-digit' })
  const day = (one: Date) => one.toDateString()
  if (day(date) === day(now)) return time
  return `${date.toLocaleDateString('en-GB', { day: 'numeric', month: 'short', year: date.getFullYear() === now.getFullYear() ? undefined : 'numeric' })}, ${time}`
}

/** Seconds while they are few. */
export function lasted({ duration }: Run): string {
  if (duration === null) return ''
  return duration < 60 ? `${fixed(duration, duration < 10 ? 1 : 0)} s` : clock(duration)
}

export function written(value: Value): string {
  return value.number === null ? value.text : `${significant(value.number)} ${printed(value.unit)}`.trim()
}

/** Why a run's files are not there. */
export const GONE = { here: '', missing: 'moved or removed', replaced: 'a later run lies there', deleted: 'in the bin' } as const
