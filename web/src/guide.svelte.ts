// The guided experiment: steps done and the next step.

import { bench } from './bench.svelte'
import { design } from './design/design.svelte'
import { measurement } from './measurement.svelte'
import { trials } from './test/trials.svelte'
import { view } from './view.svelte'

export type Step = { name: string; done: boolean; off: string | null; run: () => void }

export function steps(): Step[] {
  const fitted = measurement.curve?.fit != null && !measurement.curve.measuring
  const measured = (measurement.curve?.points.length ?? 0) > 0 && !measurement.curve?.measuring
  const rendered = measurement.rendered?.run != null && measurement.rendered.run > (measurement.curve?.run ?? 0)
  return [
    { name: 'Home axis', done: bench.homed, off: bench.busy, run: () => void bench.command({ call: 'home' }) },
    { name: 'Measure', done: measured, off: null, run: () => view.go('/friction') },
    { name: 'Fit', done: fitted, off: null, run: () => view.go('/friction') },
    { name: 'Download', done: fitted && measurement.downloaded, off: fitted ? null : 'Fit first', run: () => (view.go('/friction'), measurement.offer()) },
    { name: 'Design', done: design.changes > 0 || design.downloaded, off: null, run: () => view.go('/design') },
    { name: 'Download design', done: design.downloaded && design.changes === 0, off: design.changes || design.downloaded ? null : 'Design first', run: () => (view.go('/design'), void design.offer()) },
    { name: 'Measure again', done: rendered && !measurement.rendering, off: bench.busy, run: () => void measurement.measureRendered() },
    { name: 'Report', done: rendered && (measurement.report ?? 0) > (measurement.rendered?.run ?? 0), off: rendered ? null : 'Measure with rendered friction first', run: () => void measurement.save() },
    { name: 'Compare', done: rendered && trials.comparison?.complete === true && trials.comparison.run > (measurement.rendered?.run ?? 0), off: null, run: () => view.go('/test?compare') },
  ]
}
