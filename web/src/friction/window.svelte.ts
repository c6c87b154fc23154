// What the window of the measurement shows: which run, which plot, what comes next.

import { bench } from '../bench.svelte'
import { design } from '../design/design.svelte'
import { measurement, type Tab } from '../measurement.svelte'
import type { Figure } from '../plot/export'
import type { BreakawayMeasurement, MeasuredCurve, Picture } from '../protocol'

/** The figures of a friction under the law, by tab. */
const RENDERED: Partial<Record<Tab, number>> = { shaped: 0, rendered: 1, load: 2 }

class FrictionWindow {
  stretch = $state(true)
  /** The part of the speed axis that is shown, where it was chosen by hand. */
  range = $state<[number, number] | null>(null)
  /** The figure that can be exported. */
  figure = $state.raw<(() => Figure) | null>(null)
  recipe = $state(false)
  table = $state(false)
  exporting = $state(false)
  /** The run that the address asks for, and its curve. */
  wanted = $state<number | null>(null)
  old = $state.raw<MeasuredCurve | null>(null)

  shown = $derived(this.old && !bench.measuring ? this.old : measurement.curve)
  /** The friction is being measured; until the curve that it leaves is here. */
  measuring = $derived((measurement.running === 'friction' && !measurement.rendering) || (this.shown?.measuring ?? false))
  fit = $derived(this.shown?.fit ?? null)
  has = $derived((this.shown?.points.length ?? 0) > 0)
  tab = $derived<Tab>(measurement.tab in RENDERED && !measurement.rendered?.figures.length ? 'speed' : measurement.tab)
  /** What was measured at rest, where that is shown. */
  atRest = $derived<BreakawayMeasurement | null>(measurement.what === 'friction' ? null : (measurement.found[measurement.what] ?? null))
  pictures = $derived.by((): Picture[] => {
    if (measurement.what !== 'friction') return this.atRest?.figures ?? []
    const one = measurement.rendered?.figures[RENDERED[this.tab] ?? -1]
    const sweep = this.tab === 'load' && !measurement.rendered?.measuring ? measurement.rendered?.figures[3] : null
    return one ? (sweep ? [one, sweep] : [one]) : []
  })
  /** Of the friction under the law. */
  shaped = $derived(this.tab in RENDERED && this.pictures.length > 0)
  /** The one next step. */
  next = $derived.by((): 'measure' | 'download' | 'design' | 'again' | 'report' => {
    if (!this.fit) return 'measure'
    if (measurement.rendering) return 'again'
    const { rendered } = measurement
    const newer = rendered?.run != null && rendered.run > (this.shown?.run ?? 0)
    if (newer && this.tab in RENDERED) return 'report'
    if (!measurement.downloaded) return 'download'
    return design.downloaded && !design.changes ? (newer ? 'report' : 'again') : 'design'
  })
  /** Why nothing can be measured; null where it can. */
  why = $derived(bench.busy ?? (bench.state === 'fault' ? 'A fault is to be acknowledged first' : measurement.wrong || null))
  downloadOff = $derived.by(() => {
    if (bench.busy) return bench.busy
    if (measurement.what !== 'friction') return Object.keys(this.atRest?.own ?? {}).length ? null : 'The measurement tells no value'
    return Object.keys(this.fit?.own ?? {}).length ? null : 'The data do not tell all four parameters'
  })
}

export const shows = new FrictionWindow()
