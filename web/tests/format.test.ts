import { expect, test } from 'vitest'
import { age, clock, fixed, significant } from '../src/format'
import { decimals, linear, stretched } from '../src/plot/ticks'

test('a number has a true minus, thin spaces from five digits on and never a minus before zero', () => {
  expect(fixed(-0.197, 3)).toBe('\u22120.197')
  expect(fixed(-0.0001, 2)).toBe('0.00')
  expect(fixed(10000, 0)).toBe('10\u202f000')
  expect(fixed(1000, 0)).toBe('1000')
})

test('a missing value is "unknown"', () => {
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

test('times have a suitable unit', () => {
  expect(clock(42.4)).toBe('0:42')
  expect(clock(83)).toBe('1:23')
  expect(age(12_300)).toBe('12\u202fs')
})

test('ticks are multiples of 1, 2 or 5 with distinct labels', () => {
  expect(linear(-0.33, 0.33)).toEqual([-0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3])
  expect(decimals([0, 0.1, 0.2])).toBe(1)
  expect(decimals([0, 20, 40])).toBe(0)
  expect(stretched(-5, 20)).toEqual([-5, -2, -1, 0, 1, 2, 5, 10, 20])
  expect(linear(0.1, 0.9, 3)).toEqual([0.2, 0.4, 0.6, 0.8])
})

test('an axis has at least two ticks, within its range and with distinct labels', () => {
  const ranges = [[0.1, 0.9], [0.31, 0.39], [0, 0.03], [3, 4.5], [-0.4, 0.7], [12, 18], [1e-4, 1.9e-4], [148, 151]] as const
  for (const [low, high] of ranges)
    for (const most of [2, 3, 5, 8])
      for (const ticks of [linear(low, high, most), stretched(low, high)]) {
        expect(ticks.length, `${low} to ${high}, at most ${most}`).toBeGreaterThanOrEqual(2)
        for (const tick of ticks) expect(tick >= low - 1e-9 && tick <= high + 1e-9).toBe(true)
        expect(new Set(ticks.map((tick) => fixed(tick, decimals(ticks)))).size).toBe(ticks.length)
      }
})
