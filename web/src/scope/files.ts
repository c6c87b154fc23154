// What leaves the scope: samples as a table, panes as a figure.

import { fixed } from '../format'
import type { Figure } from '../plot/export'
import type { Role } from '../plot/series'
import { decimals, linear } from '../plot/ticks'
import { range, steps, style, unitOf } from './draw'
import type { Ring } from './ring'
import { scope } from './scope.svelte'

/** Rows of a table at most. */
const LONGEST = 1_000_000
/** Columns of a figure's trace. */
const COLUMNS = 800

/** From the first to the last cycle of what is to leave. */
export function span(what: 'visible' | 'cursors' | 'all'): [number, number] | null {
  const { ring, view, cursors } = scope
  if (!ring || ring.next < 0) return null
  if (what === 'all') return [ring.first, ring.next - 1]
  if (what === 'visible') return [Math.max(ring.first, Math.ceil(view.from)), Math.min(ring.next - 1, Math.floor(view.to))]
  return cursors.a === null || cursors.b === null ? null : [Math.min(cursors.a, cursors.b), Math.max(cursors.a, cursors.b)]
}

/** Every cycle of the signals in the panes, with units; a cycle that is missing has no row. */
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

/** Each pane over time, as it is shown. */
export function figures(): Figure[] {
  const { ring, view } = scope
  if (!ring) return []
  const panes = scope.panes.filter((pane) => pane.kind === 'time' && pane.traces.some((trace) => !trace.hidden && scope.index(trace.name) >= 0))
  const step = Math.max(1, (view.to - view.from) / COLUMNS)
  const count = Math.ceil((view.to - view.from) / step)
  const [low, high] = [new Float64Array(count), new Float64Array(count)]
  const [first, last] = [scope.time(view.from), scope.time(view.to)]
  const xTicks = linear(first, last)
  return panes.map((pane) => {
    const traces = pane.traces.map((trace, n) => ({ trace, index: scope.index(trace.name), ...style(n) })).filter(({ trace, index }) => !trace.hidden && index >= 0)
    const [bottom, top] = pane.range ?? steps(range(ring, traces.map((one) => one.index), view), null)
    const yTicks = linear(bottom, top)
    const series = traces.map(({ index, colour, dash }) => {
      ring.extremes(index, view.from, step, count, low, high)
      const [x, y]: [number[], (number | null)[]] = [[], []]
      for (let i = 0; i < count; i++) {
        const at = scope.time(view.from + (i + 0.5) * step)
        const gap = Number.isNaN(low[i])
        x.push(at, at)
        y.push(gap ? null : low[i]!, gap ? null : high[i]!)
      }
      return { role: `trace-${colour + 1}` as Role, name: scope.signals[index]!.label, mark: 'line' as const, x, y, dash }
    })
    return {
      title: '',
      x: { label: scope.triggered === null ? 'time since the bench runs, s' : 'time since the trigger, s', range: [first, last], ticks: xTicks, warp: (value: number) => value, text: (value: number) => fixed(value, decimals(xTicks)) },
      y: { label: unitOf(traces.map((one) => scope.signals[one.index]!)), range: [bottom, top], ticks: yTicks, text: (value: number) => fixed(value, decimals(yTicks)) },
      series,
    }
  })
}
