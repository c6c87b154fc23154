// Exports of the scope: samples as a table, panes as a figure.

import { fixed } from '../format'
import type { Figure } from '../plot/export'
import type { Role } from '../plot/series'
import { decimals, linear } from '../plot/ticks'
import { range, steps, style, unitOf } from './draw'
import type { Ring } from './ring'
import { type Pane, scope } from './scope.svelte'
import * as frequencies from './spectrum'

/** Maximum rows of a table. */
const LONGEST = 1_000_000
/** Columns of a trace in a figure. */
const COLUMNS = 800
/** Points of an XY trace. */
const POINTS = 5000

/** First and last cycle of an export. */
export function span(what: 'visible' | 'cursors' | 'all'): [number, number] | null {
  const { ring, view, cursors } = scope
  if (!ring || ring.next < 0) return null
  if (what === 'all') return [ring.first, ring.next - 1]
  if (what === 'visible') return [Math.max(ring.first, Math.ceil(view.from)), Math.min(ring.next - 1, Math.floor(view.to))]
  return cursors.a === null || cursors.b === null ? null : [Math.min(cursors.a, cursors.b), Math.max(cursors.a, cursors.b)]
}

/** Every cycle of the signals in the panes, with units; missing cycles have no row. */
export function table([from, to]: [number, number]): Blob {
  const ring = scope.ring!
  const names = [...new Set(scope.panes.flatMap((pane) => pane.traces.map((trace) => trace.name)))]
  const indices = names.map((name) => scope.index(name))
  const head = ['cycle [1]', 'time [s]', ...indices.map((index) => `${scope.signals[index]!.name} [${scope.signals[index]!.unit}]`)]
  const parts = [`${head.join(',')}\n`]
  let lines: string[] = []
  const end = Math.min(to, from + LONGEST - 1)
  for (let cycle = from; cycle <= end; cycle++) {
    if (missing(ring, cycle)) continue
    const values = indices.map((index) => ring.value(index, cycle))
    lines.push([cycle, cycle / scope.rate, ...values.map((value) => (Number.isNaN(value) ? '' : value))].join(','))
    if (lines.length === 10_000) {
      parts.push(`${lines.join('\n')}\n`)
      lines = []
    }
  }
  if (lines.length) parts.push(`${lines.join('\n')}\n`)
  return new Blob(parts, { type: 'text/csv' })
}

const missing = (ring: Ring, cycle: number) => ring.gaps.some((gap) => cycle >= gap.from && cycle < gap.from + gap.cycles)

type Traced = { index: number; colour: number; dash: number[] }

/** Each pane as displayed. */
export function figures(): Figure[] {
  const { ring } = scope
  if (!ring) return []
  return scope.panes.flatMap((pane): Figure[] => {
    const traces = pane.traces.map((trace, n) => ({ trace, index: scope.index(trace.name), ...style(n) })).filter(({ trace, index }) => !trace.hidden && index >= 0)
    if (!traces.length || (pane.kind === 'xy' && traces.length < 2)) return []
    if (pane.kind === 'xy') return [xyFigure(ring, pane, traces)]
    return pane.kind === 'time' ? [timeFigure(ring, pane, traces)] : spectrumFigures(ring, pane, traces)
  })
}

const straight = (value: number) => value
const label = (index: number) => [scope.signals[index]!.label, scope.signals[index]!.printed_unit].filter(Boolean).join(', ')
const role = (colour: number) => `trace-${colour + 1}` as Role

function axis(low: number, high: number) {
  const ticks = linear(low, high)
  return { range: [low, high] as [number, number], ticks, text: (value: number) => fixed(value, decimals(ticks)) }
}

function timeFigure(ring: Ring, pane: Pane, traces: Traced[]): Figure {
  const { view } = scope
  const step = Math.max(1, (view.to - view.from) / COLUMNS)
  const count = Math.ceil((view.to - view.from) / step)
  const [low, high] = [new Float64Array(count), new Float64Array(count)]
  const series = traces.map(({ index, colour, dash }) => {
    ring.extremes(index, view.from, step, count, low, high)
    const [x, y]: [number[], (number | null)[]] = [[], []]
    for (let i = 0; i < count; i++) {
      const at = scope.time(view.from + (i + 0.5) * step)
      const gap = Number.isNaN(low[i])
      x.push(at, at)
      y.push(gap ? null : low[i]!, gap ? null : high[i]!)
    }
    return { role: role(colour), name: scope.signals[index]!.label, mark: 'line' as const, x, y, dash }
  })
  const words = scope.triggered === null ? 'time since the start of the bench, s' : 'time since the trigger, s'
  const range_y = pane.range ?? scope.displayed.get(pane.id) ?? steps(range(ring, traces.map((one) => one.index), view), null)
  return { title: '', x: { label: words, warp: straight, ...axis(scope.time(view.from), scope.time(view.to)) }, y: { label: unitOf(traces.map((one) => scope.signals[one.index]!)), ...axis(...range_y) }, series: [...series, ...cursorLines(range_y)] }
}

/** The cursors in view, with their names. */
function cursorLines([low, high]: [number, number]) {
  return (['a', 'b'] as const).flatMap((which) => {
    const cycle = scope.cursors[which]
    if (cycle === null || cycle < scope.view.from || cycle > scope.view.to) return []
    const at = scope.time(cycle)
    return [{ role: 'reference' as const, name: `Cursor ${which.toUpperCase()}`, mark: 'line' as const, x: [at, at], y: [low, high], dash: which === 'a' ? [] : [6, 3] }]
  })
}

/** One signal over another, each point a sample. */
function xyFigure(ring: Ring, pane: Pane, [across, ...up]: Traced[]): Figure {
  const { view } = scope
  const [start, end] = [Math.max(ring.first, Math.ceil(view.from)), Math.min(ring.next, Math.ceil(view.to))]
  const step = Math.max(1, Math.ceil((end - start) / POINTS))
  const cycles = Array.from({ length: Math.max(0, Math.ceil((end - start) / step)) }, (_, i) => start + i * step)
  const values = (index: number) => cycles.map((cycle) => ring.value(index, cycle)).map((value) => (Number.isNaN(value) ? null : value))
  const x = values(across!.index)
  const series = up.map(({ index, colour, dash }) => ({ role: role(colour), name: scope.signals[index]!.label, mark: 'line' as const, x, y: values(index), dash }))
  const fitting = (indices: number[]) => steps(range(ring, indices, view), null)
  return {
    title: '',
    x: { label: label(across!.index), warp: straight, ...axis(...fitting([across!.index])) },
    y: { label: unitOf(up.map((one) => scope.signals[one.index]!)), ...axis(...(pane.range ?? fitting(up.map((one) => one.index)))) },
    series,
  }
}

/** Amplitude over frequency, both logarithmic. */
function spectrumFigures(ring: Ring, pane: Pane, traces: Traced[]): Figure[] {
  const [from, to] = span('cursors') ?? [scope.view.from, scope.view.to]
  const found = traces.flatMap((one) => {
    const spectrum = frequencies.spectrum(ring, one.index, from, to, scope.rate)
    return spectrum ? [{ ...one, ...spectrum }] : []
  })
  if (!found.length) return []
  const range = frequencies.decades(found, scope.rate, null)
  const [low, high] = scope.displayed.get(pane.id) ?? [range.low, range.high]
  const series = found.map(({ index, colour, dash, step, amplitudes }) => {
    const [x, y]: [number[], number[]] = [[], []]
    for (let k = 1; k < amplitudes.length; k++) {
      x.push(k * step)
      y.push(Math.log10(Math.max(amplitudes[k]!, 1e-300)))
    }
    return { role: role(colour), name: scope.signals[index]!.label, mark: 'line' as const, x, y, dash }
  })
  const unit = unitOf(found.map((one) => scope.signals[one.index]!))
  return [
    {
      title: '',
      x: { label: 'frequency, Hz', warp: Math.log10, range: [10 ** range.from, 10 ** range.to], ticks: frequencies.powers(range.from, range.to).map((power) => 10 ** power), text: (value) => frequencies.powerText(Math.log10(value)) },
      y: { label: ['amplitude', unit].filter(Boolean).join(', '), range: [low, high], ticks: frequencies.powers(low, high), text: frequencies.powerText },
      series,
    },
  ]
}
