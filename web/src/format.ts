// Number formats: a true minus sign, thin spaces from five digits, fixed width, "unknown" for missing values.

const THIN = '\u202f'
export const UNKNOWN = 'unknown'

/** A number with a fixed count of decimals. */
export function fixed(value: number | null | undefined, decimals: number): string {
  if (value == null || !Number.isFinite(value)) return UNKNOWN
  const text = Math.abs(value).toFixed(decimals)
  const [whole = '0', rest] = text.split('.')
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, THIN) : whole
  const zero = !/[1-9]/.test(text)
  return `${value < 0 && !zero ? '\u2212' : ''}${grouped}${rest ? `.${rest}` : ''}`
}

/** A number with a given count of significant digits, for a field. */
export function significant(value: number | null | undefined, digits = 4): string {
  if (value == null || !Number.isFinite(value)) return UNKNOWN
  if (value === 0) return '0'
  const exponent = Math.floor(Math.log10(Math.abs(value)))
  if (exponent < -6 || exponent > 6) return String(Number(value.toPrecision(digits))).replace(/-/g, '\u2212')
  return fixed(Number(value.toPrecision(digits)), Math.max(0, digits - 1 - exponent)).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '')
}

/** A number for input and clipboard: plain ASCII. */
export function plain(value: number): string {
  return String(Number(value.toPrecision(12)))
}

/** A unit as displayed; empty for a dimensionless number. */
export const printed = (unit: string) => (unit === '1' ? '' : unit.replaceAll(' ', '·'))

/** A value as in a file: a name, or a number with its unit. */
export function valueText(text: string | null): string {
  const [number = '', ...unit] = (text ?? 'not set').split(' ')
  return number && Number.isFinite(Number(number)) ? `${significant(Number(number), 6)} ${printed(unit.join(' '))}`.trimEnd() : (text ?? 'not set')
}

/** Names in parameter paths that are written with a capital. */
const PROPER = /\b(coulomb|kalman|maxwell|nyquist|stribeck)\b/g

/** A key of a parameter in words: `stribeck_velocity` is Stribeck velocity. */
export const words = (key: string) => key.replaceAll('_', ' ').replace(PROPER, (name) => name[0]!.toUpperCase() + name.slice(1))

/** mm:ss. */
export function clock(seconds: number): string {
  const all = Math.max(0, Math.round(seconds))
  return `${Math.floor(all / 60)}:${String(all % 60).padStart(2, '0')}`
}

/** "12 s", "3 min". */
export function age(milliseconds: number): string {
  const seconds = Math.max(0, Math.round(milliseconds / 1000))
  return seconds < 120 ? `${seconds}${THIN}s` : `${Math.round(seconds / 60)}${THIN}min`
}

/** Splits a symbol: `M_S` is M with the index S. */
export function symbolParts(symbol: string): [string, string] {
  const [body = '', index = ''] = symbol.split('_')
  return [body, index]
}
