// State of the measurement window: run, plot and next step.

import { bench } from '../bench.svelte'
import { design } from '../design/design.svelte'
import { measurement, type Tab } from '../measurement.svelte'
import type { Figure } from '../plot/export'
import type { BreakawayMeasurement, MeasuredCurve, Picture } from '../protocol'

/** Figures of a rendered friction, by tab. */
const RENDERED: Partial<Record<Tab, number>> = { shaped: 0, rendered: 1, load: 2 }

class FrictionWindow {
  stretch = $state(true)
  /** The displayed part of the speed axis if set by hand. */
  range = $state<[number, number] | null>(null)
  /** The figure to export. */
  figure = $state.raw<(() => Figure) | null>(null)
  recipe = $state(false)
  table = $state(false)
  exporting = $state(false)
  /** The run in the address, and its curve. */
  requestedRun = $state<number | null>(null)
  old = $state.raw<MeasuredCurve | null>(null)

  shown = $derived(this.old && !bench.measuring ? this.old : measurement.curve)
  /** True from the start of a friction measurement until its curve is available. */
  measuring = $derived((measurement.running === 'friction' && !measurement.rendering) || (this.shown?.measuring ?? false))
  fit = $derived(this.shown?.fit ?? null)
  has = $derived((this.shown?.points.length ?? 0) > 0)
  tab = $derived<Tab>(measurement.tab in RENDERED && !measurement.rendered?.figures.length ? 'speed' : measurement.tab)
  /** The displayed measurement at rest. */
  atRest = $derived<BreakawayMeasurement | null>(measurement.what === 'friction' ? null : (measurement.results[measurement.what] ?? null))
  pictures = $derived.by((): Picture[] => {
    if (measurement.what !== 'friction') return this.atRest?.figures ?? []
    const one = measurement.rendered?.figures[RENDERED[this.tab] ?? -1]
    const sweep = this.tab === 'load' && !measurement.rendered?.measuring ? measurement.rendered?.figures[3] : null
    return one ? (sweep ? [one, sweep] : [one]) : []
  })
  /** True if the figures of the rendered friction are displayed. */
  shaped = $derived(this.tab in RENDERED && this.pictures.length > 0)
  /** The next step of the experiment. */
  next = $derived.by((): 'measure' | 'download' | 'design' | 'again' | 'report' => {
    if (!this.fit) return 'measure'
    if (measurement.rendering) return 'again'
    const { rendered } = measurement
    const newer = rendered?.run != null && rendered.run > (this.shown?.run ?? 0)
    if (newer && this.tab in RENDERED) return 'report'
    if (!measurement.downloaded) return 'download'
    return design.downloaded && !design.changes ? (newer ? 'report' : 'again') : 'design'
  })
  /** The reason why measuring is disabled; null if it is enabled. */
  why = $derived(bench.busy ?? (bench.state === 'fault' ? 'Acknowledge the fault first' : measurement.wrong || null))
  downloadOff = $derived.by(() => {
    if (bench.busy) return bench.busy
    if (measurement.what !== 'friction') return Object.keys(this.atRest?.own ?? {}).length ? null : 'The measurement has no result'
    return Object.keys(this.fit?.own ?? {}).length ? null : 'The data do not determine all four parameters'
  })
}

export const frictionView = new FrictionWindow()
