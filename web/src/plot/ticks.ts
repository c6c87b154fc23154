// Positions and font of axis ticks.

/** The font of all texts in plots. A whole number of pixels: uPlot scales the digits before "px" only, so that "11.5px" is drawn as "11.10px" at a device pixel ratio of 2. */
export const FONT = '12px Inter, system-ui'

/** An axis with a single number has no scale. */
const LEAST = 2
const STRETCHED = [0, 1, 2, 5, 10, 20, 50, 100, 150, 200, 500, 1000, 2000, 5000, 10_000]

/** Steps of 1, 2 or 5 with 4 to 9 ticks; fewer if the space is small, but at least two. */
export function linear(low: number, high: number, most = 8): number[] {
  const rough = (high - low) / most
  if (!(rough > 0)) return [low]
  const power = 10 ** Math.floor(Math.log10(rough))
  const steps = [10, 5, 2, 1, 0.5, 0.2, 0.1, 0.05].map((factor) => factor * power)
  const first = steps.findLastIndex((one) => one >= rough)
  for (const step of steps.slice(first)) {
    const ticks = multiples(low, high, step)
    if (ticks.length >= LEAST) return ticks
  }
  return [low, high]
}

function multiples(low: number, high: number, step: number): number[] {
  const ticks = []
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(Number((k * step).toPrecision(12)) + 0)
  return ticks
}

/** Linear around standstill, logarithmic beyond; linear if the range contains too few of these ticks. */
export function stretched(low: number, high: number): number[] {
  const both = [...STRETCHED.slice(1).map((tick) => -tick).reverse(), ...STRETCHED]
  const ticks = both.filter((tick) => tick >= low && tick <= high)
  return ticks.length >= LEAST ? ticks : linear(low, high)
}

/** Decimals required to distinguish the ticks. */
export function decimals(ticks: number[]): number {
  const step = ticks.length > 1 ? Math.min(...ticks.slice(1).map((tick, i) => tick - ticks[i]!)) : 1
  return Math.max(0, -Math.floor(Math.log10(step) + 1e-9))
}
