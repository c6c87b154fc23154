// Values at handles, and points as columns of a spreadsheet.

import { parseQuantity } from '../entry'
import { plain, printed, significant } from '../format'
import type { Reference } from '../protocol'

/** Value and unit, without a prefix: a field next to the plot shows the same number. */
export function quantity(value: number, unit: string): [string, string] {
  return [significant(value, 3), printed(unit)]
}

/** A unit in words, for screen readers. */
export function spoken(unit: string): string {
  return unit.replace('N', 'newton').replaceAll('·', ' ').replace(/\bm\b/, 'metre').replace(/\bs\b/, 'second').replace('rad', 'radian').replace('/', ' per ')
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
