// Numbers as people type them: decimal point or comma, SI prefix, unit, per cent.

/** A unit that is accepted in place of the unit of a field; `factor` of them are one of the field. */
export type OtherUnit = { unit: string; factor: number }

const PREFIXES: Record<string, number> = { n: 1e-9, µ: 1e-6, μ: 1e-6, u: 1e-6, m: 1e-3, k: 1e3, M: 1e6 }
const NUMBER = /^([+\-\u2212]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+\-\u2212]?\d+)?)(?![\d.,])(.*)$/
/** A comma followed by three digits separates either decimals or thousands. */
const AMBIGUOUS = /^[+-]?[1-9]\d{0,2},\d{3}$/
const bare = (text: string) => text.replace(/[\s\u202f·⋅*]/g, '').replaceAll('^2', '²')
const dimensionless = (unit: string) => unit === '' || unit === '1'

/** The value of an input in `unit`; without `unit` every unit is accepted. Null for invalid or ambiguous input. */
export function parseQuantity(text: string, unit?: string, others: readonly OtherUnit[] = []): number | null {
  const [digits, behind] = split(text)
  if (AMBIGUOUS.test(digits)) return null
  const number = digits ? Number(digits.replace(',', '.')) : NaN
  if (!Number.isFinite(number)) return null
  if (behind === '%' && unit !== undefined && dimensionless(unit)) return number / 100
  const fits = (rest: string) => rest === '' || rest === bare(unit ?? rest)
  if (fits(behind) && !(unit === undefined && behind in PREFIXES)) return number
  const other = others.find((one) => bare(one.unit) === behind)
  if (other) return number / other.factor
  const prefix = PREFIXES[behind[0]!]
  return prefix !== undefined && fits(behind.slice(1)) ? number * prefix : null
}

/** Why an input is refused, with the accepted forms. */
export function refusal(text: string, unit: string, others: readonly OtherUnit[] = []): string {
  const [digits] = split(text)
  if (AMBIGUOUS.test(digits)) return `"${digits}" is ambiguous. Enter ${digits.replace(',', '')} or ${digits.replace(',', '.').replace(/0+$/, '').replace(/\.$/, '.0')}`
  if (dimensionless(unit)) return 'Enter a number, for example "0.15", "0,15", "1e-3" or "15 %"'
  const also = others.map((one) => one.unit).filter((one) => bare(one) !== bare(unit))
  return `Enter a number in ${[unit, ...also].join(' or ')}, for example "0.15", "0,15", "150m", "1e-3" or "0.15 ${unit}"`
}

/** The number and the rest of an input. */
function split(text: string): [string, string] {
  const match = NUMBER.exec(bare(text))
  return match ? [match[1]!.replaceAll('\u2212', '-'), match[2]!] : ['', '']
}
