// Numbers with their 95 % interval.

import { fixed, significant } from '../format'

/** A value, with the half of its interval if there is one, both to the same place. */
export function estimate(value: number | null | undefined, half: number | null | undefined): string {
  if (value == null) return '–'
  if (!half) return significant(value, 3)
  const exponent = Math.floor(Math.log10(half))
  const leading = half / 10 ** exponent
  const decimals = Math.max(0, (leading < 2 ? 1 : 0) - exponent)
  return `${fixed(value, decimals)} ± ${fixed(half, decimals)}`
}
