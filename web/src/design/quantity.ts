// Values at handles: with unit and a fixed number of digits; small values with a prefix.

import { parseQuantity } from '../entry'
import { fixed, plain, printed } from '../format'
import type { Reference } from '../protocol'

/** Value and unit. */
export function quantity(value: number, unit: string): [string, string] {
  const small = /^N/.test(unit) && Math.abs(value) < 0.05
  const shown = small ? value * 1e3 : value
  const decimals = Math.abs(shown) >= 100 ? 0 : Math.abs(shown) >= 10 ? 1 : Math.abs(shown) >= 1 ? 2 : 3
  return [fixed(shown, decimals), small ? `m${printed(unit)}` : printed(unit)]
}

/** A unit in words, for screen readers. */
export function spoken(unit: string): string {
  return unit.replace('mN', 'millinewton').replace('N', 'newton').replaceAll('·', ' ').replace(/\bm\b/, 'metre').replace(/\bs\b/, 'second').replace('rad', 'radian').replace('/', ' per ')
}

/** Points from spreadsheet columns: speed, torque, optional weight; rows without numbers are ignored. */
export function columns(text: string, factor: number): Reference[] {
  return text.split(/\r?\n/).flatMap((row) => {
    const cells = row.trim().split(/\t|;|\s+|,(?=\s)/).filter(Boolean)
    const [speed, torque, weight] = cells.map((cell) => parseQuantity(cell.replace(',', '.')))
    if (speed == null || torque == null) return []
    return [{ speed: Math.abs(speed) / factor, torque: Math.abs(torque), weight: weight ?? 1 }]
  })
}

/** Points as tab-separated text. */
export function tabbed(points: Reference[], factor: number): string {
  return points.map((point) => [point.speed * factor, point.torque, point.weight ?? 1].map(plain).join('\t')).join('\n')
}
