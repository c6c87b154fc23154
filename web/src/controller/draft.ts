// Drafts as values by path, independent of parameter names.

export type Values = Record<string, string>

/** Edits of the same field within this time are one undo step [ms]. */
const TOGETHER = 1200
const STEPS = 100

/** Adds a value. A changed choice discards the values below the previous choice. */
export function without(values: Values, path: string, value: string): Values {
  const choice = /^(.*\.)kind$/.exec(path)?.[1]
  const left = Object.entries(values).filter(([one]) => !choice || !one.startsWith(choice))
  return { ...Object.fromEntries(left), [path]: value }
}

/** The undo steps with a new one, unless it continues the last step. */
export function nearestStep<S extends { key: string }>(past: S[], step: S, last: number, now: number): { past: S[]; last: number } {
  const same = past.at(-1)?.key === step.key && now - last < TOGETHER
  return { past: same ? past : [...past.slice(1 - STEPS), step], last: now }
}

/** The index of the nearest number in an ascending list. */
export function nearest(numbers: readonly number[], target: number): number {
  let best = 0
  numbers.forEach((one, i) => {
    if (Math.abs(one - target) < Math.abs(numbers[best]! - target)) best = i
  })
  return best
}

/** The index of the nearest point in the plane. */
export function nearestPoint(x: readonly number[], y: readonly number[], at: { x: number; y: number }): number {
  const off = (i: number) => Math.hypot(x[i]! - at.x, y[i]! - at.y)
  return x.reduce((best, _, i) => (off(i) < off(best) ? i : best), 0)
}
