import { expect, test } from 'vitest'
import { parseQuantity } from '../src/format'

test('a number may have a prefix of the SI and the unit of its field', () => {
  expect(parseQuantity('0.3', 'N·m')).toBe(0.3)
  expect(parseQuantity('12m', 'N·m')).toBeCloseTo(0.012)
  expect(parseQuantity('12 mN·m', 'N·m')).toBeCloseTo(0.012)
  expect(parseQuantity('0.3 N m', 'N·m')).toBe(0.3)
  expect(parseQuantity('12 mm', 'm')).toBeCloseTo(0.012)
  expect(parseQuantity('12 m', 'm')).toBe(12)
  expect(parseQuantity('\u22121.5e2', 'rad/s')).toBe(-150)
  expect(parseQuantity('10\u202f000', '')).toBe(10_000)
})

test('a number in another unit is refused, not taken for one in SI units', () => {
  expect(parseQuantity('1.5 rpm', 'rad/s')).toBeNull()
  expect(parseQuantity('3 kg', 'N·m')).toBeNull()
})

test('invalid input gives null, and a comma does not cut off digits', () => {
  for (const text of ['', 'fast', '1.2.3', '1,5', '1,5 N·m']) expect(parseQuantity(text, 'N·m')).toBeNull()
})

test('without an expected unit, any unit is accepted', () => {
  expect(parseQuantity('0.3 N·m')).toBe(0.3)
  expect(parseQuantity('12m')).toBeCloseTo(0.012)
  expect(parseQuantity('much')).toBeNull()
})
