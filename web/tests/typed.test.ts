import { expect, test } from 'vitest'
import { typed } from '../src/format'

test('a number may have a prefix of the SI and the unit of its field', () => {
  expect(typed('0.3', 'N·m')).toBe(0.3)
  expect(typed('12m', 'N·m')).toBeCloseTo(0.012)
  expect(typed('12 mN·m', 'N·m')).toBeCloseTo(0.012)
  expect(typed('0.3 N m', 'N·m')).toBe(0.3)
  expect(typed('12 mm', 'm')).toBeCloseTo(0.012)
  expect(typed('12 m', 'm')).toBe(12)
  expect(typed('\u22121.5e2', 'rad/s')).toBe(-150)
  expect(typed('10\u202f000', '')).toBe(10_000)
})

test('a number in another unit is refused, not taken for one in SI units', () => {
  expect(typed('1.5 rpm', 'rad/s')).toBeNull()
  expect(typed('3 kg', 'N·m')).toBeNull()
})

test('what is no number is none, and a comma cuts nothing off', () => {
  for (const text of ['', 'fast', '1.2.3', '1,5', '1,5 N·m']) expect(typed(text, 'N·m')).toBeNull()
})

test('without a unit to hold against, any may stand behind', () => {
  expect(typed('0.3 N·m')).toBe(0.3)
  expect(typed('12m')).toBeCloseTo(0.012)
  expect(typed('much')).toBeNull()
})
