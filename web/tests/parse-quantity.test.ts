import { expect, test } from 'vitest'
import { parseQuantity, refusal } from '../src/entry'

const RPM = { unit: 'rpm', factor: 60 / (2 * Math.PI) }

test('a number may have a prefix of the SI and the unit of its field', () => {
  expect(parseQuantity('0.3', 'N·m')).toBe(0.3)
  expect(parseQuantity('12m', 'N·m')).toBeCloseTo(0.012)
  expect(parseQuantity('150m', 'N·m')).toBeCloseTo(0.15)
  expect(parseQuantity('12 mN·m', 'N·m')).toBeCloseTo(0.012)
  expect(parseQuantity('3M', 'Hz')).toBe(3e6)
  expect(parseQuantity('5 μm', 'm')).toBeCloseTo(5e-6)
  expect(parseQuantity('12 mm', 'm')).toBeCloseTo(0.012)
  expect(parseQuantity('12 m', 'm')).toBe(12)
  expect(parseQuantity('1e-3', 'N·m')).toBe(1e-3)
  expect(parseQuantity('\u22121.5e2', 'rad/s')).toBe(-150)
  expect(parseQuantity('10\u202f000', '')).toBe(10_000)
})

test('the product in a unit may be a dot, an asterisk, a space or nothing', () => {
  for (const text of ['0.15 N·m', '0.15 N*m', '0.15 N m', '0.15Nm']) expect(parseQuantity(text, 'N·m')).toBe(0.15)
  expect(parseQuantity('2 kg*m^2', 'kg·m²')).toBe(2)
})

test('a comma is a decimal comma, also with a unit or an exponent', () => {
  expect(parseQuantity('0,15', 'N·m')).toBe(0.15)
  expect(parseQuantity('1,5 N·m', 'N·m')).toBe(1.5)
  expect(parseQuantity(',5', 'N·m')).toBe(0.5)
  expect(parseQuantity('1,5e-3', 'N·m')).toBe(1.5e-3)
  expect(parseQuantity('0,150', 'N·m')).toBe(0.15)
})

test('a comma that can separate thousands is refused, with both meanings', () => {
  expect(parseQuantity('1,500', 'rad/s')).toBeNull()
  expect(refusal('1,500', 'rad/s')).toBe('"1,500" is ambiguous. Enter 1500 or 1.5')
  expect(refusal('2,000 Hz', 'Hz')).toBe('"2,000" is ambiguous. Enter 2000 or 2.0')
  for (const text of ['1,234.5', '1.234,5', '1,2,3', '1.2.3']) expect(parseQuantity(text, 'rad/s')).toBeNull()
})

test('per cent is accepted for a number without a unit and in per cent', () => {
  expect(parseQuantity('15 %', '')).toBeCloseTo(0.15)
  expect(parseQuantity('15 %', '1')).toBeCloseTo(0.15)
  expect(parseQuantity('15 %', '%')).toBe(15)
  expect(parseQuantity('15 %', 'N·m')).toBeNull()
})

test('a number in another unit is converted if the bench has a factor, else refused', () => {
  expect(parseQuantity('60 rpm', 'rad/s', [RPM])).toBeCloseTo(2 * Math.PI)
  expect(parseQuantity('1.5 rpm', 'rad/s')).toBeNull()
  expect(parseQuantity('3 kg', 'N·m')).toBeNull()
})

test('invalid input is refused with the accepted forms', () => {
  for (const text of ['', 'fast', '1.2.3', '--1', '1e', '15 % N·m']) expect(parseQuantity(text, 'N·m')).toBeNull()
  expect(refusal('fast', 'N·m')).toBe('Enter a number in N·m, for example "0.15", "0,15", "150m", "1e-3" or "0.15 N·m"')
  expect(refusal('fast', 'rad/s', [RPM])).toMatch(/^Enter a number in rad\/s or rpm, /)
  expect(refusal('fast', '')).toBe('Enter a number, for example "0.15", "0,15", "1e-3" or "15 %"')
})

test('without an expected unit, any unit is accepted', () => {
  expect(parseQuantity('0.3 N·m')).toBe(0.3)
  expect(parseQuantity('12m')).toBeCloseTo(0.012)
  expect(parseQuantity('much')).toBeNull()
})
