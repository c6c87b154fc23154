import { expect, test } from 'vitest'
import { age, clock, fixed, significant, typed } from '../src/format'
import { decimals, linear, stretched } from '../src/plot/ticks'

test('a number has a true minus, thin spaces from five digits on and never a minus before zero', () => {
  expect(fixed(-0.197, 3)).toBe('\u22120.197')
  expect(fixed(-0.0001, 2)).toBe('0.00')
  expect(fixed(10000, 0)).toBe('10\u202f000')
  expect(fixed(1000, 0)).toBe('1000')
})

test('what is not known is called so', () => {
  for (const value of [null, undefined, NaN, Infinity]) expect(fixed(value, 2)).toBe('unknown')
  expect(significant(null)).toBe('unknown')
})

test('a field has four digits', () => {
  expect(significant(0.299412)).toBe('0.2994')
  expect(significant(1234.56)).toBe('1235')
  expect(significant(4000)).toBe('4000')
  expect(significant(0)).toBe('0')
  expect(significant(2e-5)).toBe('0.00002')
})

test('what is typed may have a prefix and a unit', () => {
  expect(typed('12m')).toBeCloseTo(0.012)
  expect(typed('0.3 N·m')).toBe(0.3)
  expect(typed('\u22121.5')).toBe(-1.5)
  expect(typed('10\u202f000')).toBe(10000)
  expect(typed('much')).toBeNull()
})

test('times are read at a glance', () => {
  expect(clock(42.4)).toBe('0:42')
  expect(clock(83)).toBe('1:23')
  expect(age(12_300)).toBe('12\u202fs')
})

test('ticks are 1, 2, 5 and tell each other apart', () => {
  expect(linear(-0.33, 0.33)).toEqual([-0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3])
  expect(decimals([0, 0.1, 0.2])).toBe(1)
  expect(decimals([0, 20, 40])).toBe(0)
  expect(stretched(-5, 20)).toEqual([-5, -2, -1, 0, 1, 2, 5, 10, 20])
})
