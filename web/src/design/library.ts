// Earlier runs as points or as a curve.

import type { Reference } from '../protocol'
import { curve } from '../runs'
import { OWN } from './design.svelte'

/** Maximum number of points from a run. */
const MOST = 24

export async function fromRun(run: number): Promise<{ points: Reference[]; desired: [number, number, number, number] | null } | null> {
  const loaded = await curve(run)
  if (!loaded) return null
  const forward = loaded.points.filter((point) => point.velocity > 0 && point.torque > 0)
  const every = Math.max(1, Math.ceil(forward.length / MOST))
  const points = forward.filter((_, index) => index % every === 0).map(({ velocity, torque }) => ({ speed: velocity, torque, weight: 1 }))
  const numbers = OWN.map((path) => Number(loaded.fit?.own[path] ?? NaN))
  return { points, desired: numbers.every(Number.isFinite) ? (numbers as [number, number, number, number]) : null }
}
