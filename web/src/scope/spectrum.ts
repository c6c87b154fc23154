// Amplitude spectrum of a signal.

import FFT from 'fft.js'
import { age, significant } from '../format'
import type { Box, Colours } from './draw'
import { FONT } from '../plot/ticks'
import type { Ring } from './ring'

/** Maximum number of samples: the newest of the range. */
const MOST = 1 << 16
/** Minimum number of samples. */
const LEAST = 16
/** Displayed decades of the amplitude. */
const DECADES = 5

export type Spectrum = {
  /** Frequency step [Hz]. */
  step: number
  /** Amplitude of a sine at each frequency; without the mean. */
  amplitudes: Float64Array
}

const transforms = new Map<number, FFT>()

/** Which cycles a spectrum shows: the newest ones, or a fixed range with its age. */
export function about({ step }: Spectrum, shows: { cursors: boolean; follow: boolean; end: number; now: number | null; rate: number }): string {
  const length = `${significant(1 / step, 3)} s`
  const what = shows.cursors ? `${length} between the cursors` : `${length} of the visible range`
  if (shows.now === null) return `${what}, of the capture`
  if (!shows.cursors && shows.follow && shows.end >= shows.now - 1) return `newest ${length}, live`
  return `${what}, ${age((1e3 * Math.max(0, shows.now - shows.end)) / shows.rate)} old`
}

/** The amplitudes of a signal in the newest power of two of cycles of a range, with a Hann window; `null` if cycles are missing or too few. */
export function spectrum(ring: Ring, signal: number, from: number, to: number, rate: number): Spectrum | null {
  const end = Math.min(ring.next, Math.floor(to) + 1)
  const there = end - Math.max(ring.first, Math.ceil(from))
  if (there < LEAST) return null
  const count = Math.min(MOST, 2 ** Math.floor(Math.log2(there)))
  const values = new Array<number>(count)
  let sum = 0
  for (let i = 0; i < count; i++) sum += values[i] = ring.value(signal, end - count + i)
  if (Number.isNaN(sum)) return null
  const mean = sum / count
  for (let i = 0; i < count; i++) values[i] = (values[i]! - mean) * (0.5 - 0.5 * Math.cos((2 * Math.PI * i) / count))
  let transform = transforms.get(count)
  if (!transform) transforms.set(count, (transform = new FFT(count)))
  const out = transform.createComplexArray()
  transform.realTransform(out, values)
  // A Hann window has the mean one half, and a sine has two lines.
  const amplitudes = Float64Array.from({ length: count / 2 }, (_, k) => (4 / count) * Math.hypot(out[2 * k]!, out[2 * k + 1]!))
  amplitudes[0] = 0
  return { step: rate / count, amplitudes }
}

/** The largest amplitude and its frequency, interpolated from the two largest lines of a Hann window (T. Grandke, Interpolation algorithms for discrete Fourier transforms of weighted signals, 1983). */
export function peak({ step, amplitudes }: Spectrum): { frequency: number; amplitude: number } | null {
  let at = 0
  amplitudes.forEach((amplitude, k) => (at = amplitude > amplitudes[at]! ? k : at))
  if (!amplitudes[at]) return null
  const [before, behind] = [amplitudes[at - 1] ?? 0, amplitudes[at + 1] ?? 0]
  const ratio = Math.max(before, behind) / amplitudes[at]!
  const off = Math.min(0.5, Math.max(0, (2 * ratio - 1) / (ratio + 1)))
  const lobe = off > 1e-6 ? (Math.PI * off * (1 - off * off)) / Math.sin(Math.PI * off) : 1
  return { frequency: (at + (behind > before ? off : -off)) * step, amplitude: amplitudes[at]! * lobe }
}

/** Logarithmic axes; the rest of the box as in a pane over time. */
export type Decades = Pick<Box, 'left' | 'right' | 'top' | 'bottom'> & { from: number; to: number; low: number; high: number }

export function decades(spectra: Spectrum[], rate: number, before: Decades | null): Pick<Decades, 'from' | 'to' | 'low' | 'high'> {
  const most = Math.max(...spectra.flatMap((one) => peak(one)?.amplitude ?? 0), 1e-12)
  const top = Math.ceil(Math.log10(most) + 0.1)
  // The range is kept while the maximum is in its upper two decades.
  const high = before && Math.log10(most) < before.high && Math.log10(most) > before.high - 2 ? before.high : top
  const step = Math.min(...spectra.map((one) => one.step), rate / 2 / 10)
  return { from: Math.log10(step), to: Math.log10(rate / 2), low: high - DECADES, high }
}

export const placeX = (box: Decades, hertz: number) => box.left + ((Math.log10(hertz) - box.from) / (box.to - box.from)) * (box.right - box.left)
export const placeY = (box: Decades, amplitude: number) => box.bottom - ((Math.log10(Math.max(amplitude, 1e-300)) - box.low) / (box.high - box.low)) * (box.bottom - box.top)
export const hertzAt = (box: Decades, left: number) => 10 ** (box.from + ((left - box.left) / (box.right - box.left)) * (box.to - box.from))

/** Powers of ten within a range, and their labels. */
export function powers(low: number, high: number): number[] {
  const ticks = []
  for (let k = Math.ceil(low - 1e-9); k <= high + 1e-9; k++) ticks.push(k)
  return ticks
}

export const powerText = (power: number) => (power >= -3 && power <= 4 ? significant(10 ** power, 1) : `1e${power}`)

/** Grid and labels. */
export function axes(context: CanvasRenderingContext2D, box: Decades, colours: Colours, unit: string) {
  const { left, right, top, bottom } = box
  context.font = FONT
  context.lineWidth = 1
  const line = (x1: number, y1: number, x2: number, y2: number, colour: string) => {
    context.strokeStyle = colour
    context.beginPath()
    context.moveTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5)
    context.lineTo(Math.round(x2) + 0.5, Math.round(y2) + 0.5)
    context.stroke()
  }
  context.fillStyle = colours.quiet
  context.textAlign = 'right'
  context.textBaseline = 'middle'
  const every = Math.max(1, Math.ceil(((box.high - box.low) * 22) / (bottom - top)))
  for (const power of powers(box.low, box.high)) {
    const y = placeY(box, 10 ** power)
    line(left, y, right, y, colours.grid)
    if ((power - Math.round(box.high)) % every === 0) context.fillText(powerText(power), left - 8, y + 0.5)
  }
  context.textAlign = 'center'
  context.textBaseline = 'top'
  for (const power of powers(box.from - 1, box.to)) {
    for (let k = 1; k < 10; k++) {
      const at = placeX(box, k * 10 ** power)
      if (at < left - 1 || at > right + 1) continue
      line(at, top, at, bottom, k === 1 ? colours.axis : colours.grid)
      if (k === 1) context.fillText(powerText(power), at, bottom + 5)
    }
  }
  line(left, bottom, right, bottom, colours.axis)
  context.fillStyle = colours.text
  context.fillText('frequency, Hz', (left + right) / 2, bottom + 19)
  if (bottom - top > 40) {
    context.save()
    context.translate(11, (top + bottom) / 2)
    context.rotate(-Math.PI / 2)
    context.textBaseline = 'middle'
    context.fillText(['amplitude', unit].filter(Boolean).join(', '), 0, 0)
    context.restore()
  }
}

/** One line; several values per pixel are drawn as their maximum. */
export function line(context: CanvasRenderingContext2D, box: Decades, { step, amplitudes }: Spectrum, colour: string, dash: number[]) {
  context.strokeStyle = colour
  context.lineWidth = 1.4
  context.setLineDash(dash)
  context.beginPath()
  let [pixel, most] = [-1, 0]
  const put = () => pixel >= 0 && context.lineTo(pixel, placeY(box, most))
  for (let k = 1; k < amplitudes.length; k++) {
    const at = Math.round(placeX(box, k * step))
    if (at !== pixel) {
      put()
      ;[pixel, most] = [at, 0]
    }
    most = Math.max(most, amplitudes[k]!)
  }
  put()
  context.stroke()
  context.setLineDash([])
}
