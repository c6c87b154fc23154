// The limits of a desired friction: what bounds it, and the nearest of all.

import { significant } from '../format'
import type { ChatterMargin, NearestLimit } from '../protocol'
import { quantity } from './quantity'

/** A limit in words, and the parameters that move it. */
export const LIMITS: Record<string, { words: string; group: string }> = {
  wheel: { words: 'friction wheel', group: 'plant.wheel' },
  drive: { words: 'drive motor torque', group: 'bench.controller' },
  current: { words: 'load motor current', group: 'model.load_motor' },
  voltage: { words: 'supply voltage', group: 'model.load_motor' },
  slope: { words: 'slope (supply voltage)', group: 'model.load_motor' },
  response: { words: 'slope (delay and observer)', group: 'bench' },
  speed: { words: 'screw speed', group: 'model' },
}

/** The nearest limit: remaining share of the way to it, 0 … 1, and in words. */
export type Weakest = { left: number; text: string }

/** The nearest of the limits of the region and of the stability of the law; null: unknown. */
export function weakest(nearest: NearestLimit | null | undefined, margin: ChatterMargin | null, speed: { factor: number; unit: string }): Weakest | null {
  const of = (name: string, needed: number, available: number, unit: string) => `${name}: ${quantity(needed, unit).join(' ')} of ${quantity(available, unit).join(' ')}`
  const all: Weakest[] = []
  if (nearest) {
    const name = LIMITS[nearest.limit]?.words ?? nearest.limit
    const text = `${of(name[0]!.toUpperCase() + name.slice(1), nearest.needed, nearest.available, nearest.unit)} at ${significant(nearest.speed * speed.factor, 3)} ${speed.unit}`
    all.push({ left: nearest.left, text })
  }
  if (margin && !margin.stable) all.push({ left: 0, text: margin.sentence })
  else if (margin?.left != null) {
    const text = margin.nearest === 'stiffness' ? of('Bristle stiffness', margin.stiffness ?? NaN, margin.stiffness_limit ?? NaN, 'N·m/rad') : of('Chatter', margin.chatter, margin.chatter_limit, 'N·m')
    all.push({ left: margin.left, text })
  }
  return all.sort((a, b) => a.left - b.left)[0] ?? null
}
