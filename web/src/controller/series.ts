// A loop as plot series: the draft in the colours of the figures of `stickslip loop`, the target in grey.

import type { LoopAt, LoopView } from '../protocol'
import type { Role, Series, Stop } from '../plot/series'
import type { Load } from './controller.svelte'

const ROLES: Record<string, Role> = { sliding: 'trace-1', stuck: 'trace-2' }
const NAMES: Record<string, string> = { sliding: 'Sliding', stuck: 'Stuck' }
/** Dashes for the stuck load of the target. */
const DOTS = [2, 3]

/** The displayed loads. */
export const displayedLoads = (loop: LoopView | null, load: Load): LoopAt[] => (loop?.loads ?? []).filter((at) => load === 'both' || at.load === load)

/** The displayed loads with a stable loop: only these have margins. */
export const stable = (loop: LoopView | null, load: Load) => displayedLoads(loop, load).filter((at) => at.stable)

type Columns = (at: LoopAt) => { x: readonly number[]; y: readonly number[] }

/** A line for each displayed load; behind it, in grey, the line of the target if it differs. */
export function lines(loop: LoopView | null, target: LoopView | null, load: Load, columns: Columns): Series[] {
  const grey = displayedLoads(target, load).map((at): Series => ({ role: 'measured', name: 'Target', mark: 'line', dash: at.load === 'stuck' ? DOTS : [], aside: true, ...columns(at) }))
  return [...grey, ...displayedLoads(loop, load).map((at): Series => ({ role: ROLES[at.load]!, name: NAMES[at.load]!, mark: 'line', ...columns(at) }))]
}

export const magnitude: Columns = (at) => ({ x: at.frequency, y: at.decibels })
export const phase: Columns = (at) => ({ x: at.frequency, y: at.phase })
export const plane: Columns = (at) => ({ x: at.real, y: at.imaginary })
export const setpoint: Columns = (at) => ({ x: at.time.slice(0, at.setpoint.length), y: at.setpoint })
export const disturbed: Columns = (at) => ({ x: at.time.slice(0, at.disturbed.length), y: at.disturbed })

/** The margins of the displayed loads. */
export function stops(loop: LoopView | null, load: Load, place: (mark: LoopAt['marks'][number]) => [number, number]): Stop[] {
  return stable(loop, load).flatMap((at) => at.marks.map((mark) => ({ x: place(mark)[0], y: place(mark)[1], text: `load ${at.load}: ${mark.text}` })))
}

/** The margins as points. */
export function points(stops: Stop[]): Series[] {
  return stops.length ? [{ role: 'reference', name: 'Margins', mark: 'points', size: 4, aside: true, x: stops.map(({ x }) => x), y: stops.map(({ y }) => y) }] : []
}

/** A margin of each loop as a line from the curve to the stability limit. */
export function reach(loop: LoopView | null, load: Load, name: string, to: number, value: (mark: LoopAt['marks'][number]) => number): Series[] {
  const marks = stable(loop, load).flatMap((at) => at.marks.filter((one) => one.name === name))
  return marks.map((mark): Series => ({ role: 'reference', name: '', mark: 'line', dash: [], x: [mark.frequency, mark.frequency], y: [to, value(mark)] }))
}

/** Poles of the upper half plane. */
export function poles(loop: LoopView | null, load: Load): Series[] {
  const upper = (all: LoopAt['poles']) => all.filter((pole) => pole.imaginary >= 0)
  const place = (all: LoopAt['poles']) => ({ x: upper(all).map((pole) => pole.real), y: upper(all).map((pole) => pole.imaginary) })
  const plant = displayedLoads(loop, load).map((at): Series => ({ role: 'measured', name: 'Plant', mark: 'points', cross: true, size: 3.5, aside: true, ...place(at.plant) }))
  return [...plant, ...displayedLoads(loop, load).map((at): Series => ({ role: ROLES[at.load]!, name: NAMES[at.load]!, mark: 'points', cross: true, size: 4.5, aside: true, ...place(at.poles) }))]
}
