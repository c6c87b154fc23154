// A pane on its canvas: many samples per pixel, with all extremes visible. Axes are drawn here, too: a moving picture
// is redrawn thirty times per second or more, and only a few lines of text are constant.

import { fixed } from '../format'
import type { Mark, Signal } from '../protocol'
import { decimals, FONT, linear } from '../plot/ticks'
import type { Ring } from './ring'

/** Left margin of all panes, for the widest numbers so far [px]. */
export let left = 64
/** The margin grows in steps, so that it seldom moves [px]. */
const [STEP, WIDEST] = [16, 128]
/** Space left of the numbers of the y axis with and without a title [px]. */
const [TITLE, GAP] = [26, 14]
export const RIGHT = 14
const TOP = 5
/** Height of the time axis. */
export const BOTTOM = 34

export type Ink = { index: number; colour: string; dash: number[] }
export type Colours = Record<'text' | 'grid' | 'axis' | 'fault' | 'quiet' | 'surface', string>
/** Positions of values on the canvas [px]. */
export type Box = { left: number; right: number; top: number; bottom: number; from: number; to: number; low: number; high: number }

const [LOW, HIGH] = [new Float64Array(1), new Float64Array(1)]

/** The range of the visible samples of some signals; `null` without samples. */
export function range(ring: Ring, signals: number[], box: Pick<Box, 'from' | 'to'>): [number, number] | null {
  let [low, high] = [Infinity, -Infinity]
  for (const signal of signals) {
    ring.extremes(signal, box.from, box.to - box.from, 1, LOW, HIGH)
    low = Math.min(low, Number.isNaN(LOW[0]) ? Infinity : LOW[0]!)
    high = Math.max(high, Number.isNaN(HIGH[0]) ? -Infinity : HIGH[0]!)
  }
  return low <= high ? [low, high] : null
}

/** An axis range in steps, with a margin; the previous range is kept while it fits well. */
export function steps(range: [number, number] | null, before: [number, number] | null): [number, number] {
  if (!range) return before ?? [-1, 1]
  const [low, high] = range
  const size = high - low
  const whole = before ? before[1] - before[0] : 0
  if (before && low >= before[0] && high <= before[1] && size > 0.4 * whole) return before
  // A constant signal has a minimum range.
  const span = size > 1e-9 * Math.max(Math.abs(low), Math.abs(high)) ? size : Math.max(Math.abs(low) * 0.1, 1e-3)
  if (before && low >= before[0] && high <= before[1] && span > 0.4 * whole) return before
  const middle = (low + high) / 2
  const step = 10 ** Math.floor(Math.log10(span)) / 2
  return [Math.floor((middle - 0.55 * span) / step) * step, Math.ceil((middle + 0.55 * span) / step) * step]
}

/** Axes and grid. */
export function axes(context: CanvasRenderingContext2D, box: Box, colours: Colours, unit: string, values: string[], time: { at: (cycle: number) => number; label: string } | null) {
  const { left, right, top, bottom, low, high } = box
  const y = (value: number) => bottom - ((value - low) / (high - low)) * (bottom - top)
  context.font = FONT
  context.lineWidth = 1
  const line = (x1: number, y1: number, x2: number, y2: number, colour: string) => {
    context.strokeStyle = colour
    context.beginPath()
    context.moveTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5)
    context.lineTo(Math.round(x2) + 0.5, Math.round(y2) + 0.5)
    context.stroke()
  }
  const fits = Math.min(8, Math.max(2, (bottom - top) / 22))
  const all = values.length ? values.map((_, i) => i) : linear(low, high, fits)
  const ticks = all.filter((tick) => tick >= low && tick <= high)
  const label = (tick: number) => values[tick] ?? fixed(tick, decimals(all))
  const widest = Math.max(0, ...ticks.map((tick) => context.measureText(label(tick)).width))
  context.textAlign = 'right'
  context.textBaseline = 'middle'
  for (const tick of ticks) {
    line(left, y(tick), right, y(tick), tick === 0 ? colours.axis : colours.grid)
    context.fillStyle = colours.quiet
    context.fillText(label(tick), left - 8, y(tick) + 0.5)
  }
  if (!time) line(left, bottom, right, bottom, colours.grid)
  context.textAlign = 'center'
  if (time) {
    const [first, last] = [time.at(box.from), time.at(box.to)]
    const all = linear(first, last, room(box))
    line(left, bottom, right, bottom, colours.axis)
    context.fillStyle = colours.quiet
    context.textBaseline = 'top'
    for (const tick of all) {
      const x = left + ((tick - first) / (last - first)) * (right - left)
      context.fillText(fixed(tick, decimals(all)), x, bottom + 5)
    }
    context.fillStyle = colours.text
    context.fillText(time.label, (left + right) / 2, bottom + 19)
  }
  const title = unit ? TITLE : GAP
  if (widest > left - title) widen(widest + title)
  if (unit && bottom - top > 40 && widest <= left - TITLE) {
    context.save()
    context.translate(11, (top + bottom) / 2)
    context.rotate(-Math.PI / 2)
    context.textBaseline = 'middle'
    context.fillStyle = colours.text
    context.fillText(unit, 0, 0)
    context.restore()
  }
}

/** Makes the left margin of all panes wider. */
function widen(width: number) {
  const next = Math.min(WIDEST, STEP * Math.ceil(width / STEP))
  if (next <= left) return
  left = next
  document.documentElement.style.setProperty('--scope-left', `${left}px`)
}

/** Ticks for the available space. */
const room = (box: Box) => Math.min(8, Math.max(2, (box.right - box.left) / 90))

/** Vertical lines of the time axis, behind the traces. */
export function grid(context: CanvasRenderingContext2D, box: Box, colours: Colours, at: (cycle: number) => number) {
  const [first, last] = [at(box.from), at(box.to)]
  context.strokeStyle = colours.grid
  context.lineWidth = 1
  context.beginPath()
  for (const tick of linear(first, last, room(box))) {
    const x = Math.round(box.left + ((tick - first) / (last - first)) * (box.right - box.left)) + 0.5
    context.moveTo(x, box.top)
    context.lineTo(x, box.bottom)
  }
  context.stroke()
}

/** True if the samples are so far apart that each can be marked. */
export function sparse(box: Box): boolean {
  return box.to - box.from <= 2 * (box.right - box.left)
}

/** A signal over time, sample by sample. */
export function trace(context: CanvasRenderingContext2D, ring: Ring, box: Box, ink: Ink) {
  const { left, right, bottom, low } = box
  const across = (right - left) / (box.to - box.from)
  const up = (bottom - box.top) / (box.high - low)
  context.strokeStyle = ink.colour
  context.lineWidth = 1.4
  context.setLineDash(ink.dash)
  context.beginPath()
  let on = false
  const column = ring.columns[ink.index]!
  const end = Math.min(ring.next, Math.ceil(box.to) + 1)
  for (let cycle = Math.max(ring.first, Math.floor(box.from)); cycle < end; cycle++) {
    const value = column[cycle % ring.room]!
    if (Number.isNaN(value)) on = false
    else {
      const [x, y] = [left + (cycle - box.from) * across, bottom - (value - low) * up]
      if (on) context.lineTo(x, y)
      else context.moveTo(x, y)
      on = true
    }
  }
  context.stroke()
  context.setLineDash([])
}

/** One signal over another, at most `most` points, each a sample. */
export function across(context: CanvasRenderingContext2D, ring: Ring, view: { from: number; to: number }, x: number, place: (a: number, b: number) => [number, number], ink: Ink, most = 20_000) {
  const [a, b] = [ring.columns[x]!, ring.columns[ink.index]!]
  const [start, end] = [Math.max(ring.first, Math.ceil(view.from)), Math.min(ring.next, Math.ceil(view.to))]
  const step = Math.max(1, Math.ceil((end - start) / most))
  context.strokeStyle = ink.colour
  context.lineWidth = 1.2
  context.setLineDash(ink.dash)
  context.beginPath()
  let on = false
  for (let cycle = start - (start % step); cycle < end; cycle += step) {
    if (cycle < start) continue
    const slot = cycle % ring.room
    const [px, py] = place(a[slot]!, b[slot]!)
    if (Number.isNaN(px) || Number.isNaN(py)) on = false
    else {
      if (on) context.lineTo(px, py)
      else context.moveTo(px, py)
      on = true
    }
  }
  context.stroke()
  context.setLineDash([])
}

/** Marks and gaps over a pane. */
export function events(context: CanvasRenderingContext2D, ring: Ring, box: Box, marks: Mark[], colours: Colours) {
  const x = (cycle: number) => box.left + ((cycle - box.from) / (box.to - box.from)) * (box.right - box.left)
  context.fillStyle = colours.surface
  for (const gap of ring.gaps) {
    const [a, b] = [Math.max(box.left, x(gap.from)), Math.min(box.right, x(gap.from + gap.cycles))]
    if (b > a) context.fillRect(a, box.top, Math.max(1, b - a), box.bottom - box.top)
  }
  context.setLineDash([2, 3])
  context.lineWidth = 1
  for (const mark of marks) {
    if (mark.cycle < box.from || mark.cycle > box.to) continue
    context.strokeStyle = mark.kind === 'fault' ? colours.fault : colours.axis
    context.beginPath()
    context.moveTo(Math.round(x(mark.cycle)) + 0.5, box.top)
    context.lineTo(Math.round(x(mark.cycle)) + 0.5, box.bottom)
    context.stroke()
  }
  context.setLineDash([])
}

/** The canvas of an element at screen resolution, with its size [px]. */
export function canvas(element: HTMLCanvasElement): { context: CanvasRenderingContext2D; width: number; height: number } | null {
  const [width, height] = [element.clientWidth, element.clientHeight]
  const context = element.getContext('2d')
  if (!context || !width || !height) return null
  const scale = devicePixelRatio
  const [w, h] = [Math.round(width * scale), Math.round(height * scale)]
  if (element.width !== w || element.height !== h) [element.width, element.height] = [w, h]
  context.setTransform(scale, 0, 0, scale, 0, 0)
  context.clearRect(0, 0, width, height)
  return { context, width, height }
}

/** Colours of the theme, cached. */
export function colours(): Colours & { traces: string[] } {
  const style = getComputedStyle(document.documentElement)
  const token = (name: string) => style.getPropertyValue(`--${name}`).trim()
  return {
    text: token('text-2'), quiet: token('text-3'), grid: token('grid'), axis: token('axis'), fault: token('fault'), surface: token('surface-2'),
    traces: [1, 2, 3].map((n) => token(`trace-${n}`)),
  }
}

/** Style of the n-th trace of a pane: three colours, then dashes. */
export function style(n: number): { colour: number; dash: number[] } {
  return { colour: n % 3, dash: n < 3 ? [] : n < 6 ? [6, 3] : n < 9 ? [2, 3] : [8, 3, 2, 3] }
}

export function box(width: number, height: number, last: boolean, view: { from: number; to: number }, [low, high]: [number, number]): Box {
  return { left, right: width - RIGHT, top: TOP, bottom: height - (last ? BOTTOM : 4), ...view, low, high }
}

/** The units of all signals of an axis. */
export function unitOf(signals: Signal[]): string {
  return [...new Set(signals.map((signal) => signal.printed_unit).filter(Boolean))].join(', ')
}
