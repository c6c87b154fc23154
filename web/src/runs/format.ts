// Formats for values of the catalogue.

import { clock, fixed, printed, significant } from '../format'
import type { KeyNumber, Run, Value } from '../protocol'

export function key(number: KeyNumber | null): string {
  return number ? `${significant(number.value)} ${printed(number.unit)}`.trim() : ''
}

/** Today: the time; otherwise the date and the time. */
export function when(start: string, now = new Date()): string {
  const date = new Date(start)
  if (Number.isNaN(date.getTime())) return start
  const time = date.toLocaleTimeString('en-GB', { hour: '2-digit', minute: '2-digit' })
  const day = (one: Date) => one.toDateString()
  if (day(date) === day(now)) return time
  return `${date.toLocaleDateString('en-GB', { day: 'numeric', month: 'short', year: date.getFullYear() === now.getFullYear() ? undefined : 'numeric' })}, ${time}`
}

/** Seconds if short, otherwise m:ss. */
export function durationText({ duration }: Run): string {
  if (duration === null) return ''
  return duration < 60 ? `${fixed(duration, duration < 10 ? 1 : 0)} s` : clock(duration)
}

export function written(value: Value): string {
  return value.number === null ? value.text : `${significant(value.number)} ${printed(value.unit)}`.trim()
}

/** Reasons why the files of a run are not available. */
export const GONE = { here: '', missing: 'moved or removed', replaced: 'replaced by a later run', deleted: 'in the bin' } as const
