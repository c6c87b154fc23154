// Drafts as values by path: no name of a parameter is known here.

export type Values = Record<string, string>

/** Keys of the same field within this time are one step of undo [ms]. */
const TOGETHER = 1200
const STEPS = 100

/** With another value at a path. Another choice takes what was changed below the one before with it. */
export function without(values: Values, path: string, value: string): Values {
  const choice = /^(.*\.)kind$/.exec(path)?.[1]
  const left = Object.entries(values).filter(([one]) => !choice || !one.startsWith(choice))
  return { ...Object.fromEntries(left), [path]: value }
}

/** The steps with one more, unless it goes on with the last one. */
export function nearestStep<S extends { key: string }>(past: S[], step: S, last: number, now: number): { past: S[]; last: number } {
  const same = past.at(-1)?.key === step.key && now - last < TOGETHER
  return { past: same ? past : [...past.slice(1 - STEPS), step], last: now }
}

/** The index of the nearest of rising numbers. */
export function nearest(numbers: readonly number[], wanted: number): number {
  let best = 0
  numbers.forEach((one, i) => {
    if (Math.abs(one - wanted) < Math.abs(numbers[best]! - wanted)) best = i
  })
  return best
}

/** The index of the nearest of points in a plane. */
export function nearestPoint(x: readonly number[], y: readonly number[], at: { x: number; y: number }): number {
  const off = (i: number) => Math.hypot(x[i]! - at.x, y[i]! - at.y)
  return x.reduce((best, _, i) => (off(i) < off(best) ? i : best), 0)
}
