// A friction curve as plot series.

import { measurement } from '../measurement.svelte'
import type { MeasuredCurve } from '../protocol'
import type { Series } from '../plot/series'

/** Dashes of the compared runs. */
const DASHES = [[4, 4], [8, 3], [2, 3], [10, 3, 2, 3], [1, 4]]

/** Points, fit and band, and the compared runs; speeds are multiplied by `factor`. */
export function friction(shown: MeasuredCurve, factor: number, { measuring, own }: { measuring: boolean; own: boolean }): Series[] {
  const by = (values: readonly (number | null)[]) => values.map((value) => (value === null ? null : value * factor))
  const { fit } = shown
  const all: Series[] = []
  if (fit) all.push({ role: 'fitted', name: '95 %', mark: 'band', x: by(fit.velocity), y: fit.torque, half: fit.band })
  if (shown.course.length) all.push({ role: 'measured', name: '', mark: 'points', size: 1.3, x: shown.course.map(([v]) => v * factor), y: shown.course.map(([, t]) => t) })
  for (const [index, other] of measurement.others.entries())
    if (other.run !== shown.run && other.curve.fit) all.push({ role: 'reference', name: `Run ${other.run}${other.curve.rendered ? ', rendered' : ''}`, mark: 'line', dash: DASHES[index % DASHES.length], end: true, x: by(other.curve.fit.velocity), y: other.curve.fit.torque })
  if (fit) all.push({ role: own && !measuring ? 'own' : 'fitted', name: measuring ? 'Provisional fit' : own ? 'Own, downloaded' : 'Fit', mark: 'line', x: by(fit.velocity), y: fit.torque })
  const name = shown.run == null ? 'This run' : `Run ${shown.run}`
  all.push({ role: 'measured', name, mark: 'points', size: 2.6, x: shown.points.map((p) => p.velocity * factor), y: shown.points.map((p) => p.torque), half: shown.points.map((p) => p.half_width) })
  return all
}

/** Residuals of the fit [mN m]. */
export function residuals(shown: MeasuredCurve | null, factor: number): Series & { mark: 'points' } {
  const points = shown?.points.filter((point) => point.residual !== null) ?? []
  return { role: 'measured', name: 'residual', mark: 'points', size: 2.3, x: points.map((p) => p.velocity * factor), y: points.map((p) => 1e3 * p.residual!), half: points.map((p) => 1e3 * p.half_width) }
}

/** A range symmetric about zero, for both directions. */
export const even = (most: number): [number, number] => [-most, most]
