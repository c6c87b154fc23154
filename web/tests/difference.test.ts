import { expect, test } from 'vitest'
import type { Trace } from '../src/protocol'
import { begin, defaultTolerance, shareOutside } from '../src/simulation/difference'

const trace = (recorded: Trace['recorded'], difference: Trace['difference'] = recorded): Trace => ({ signal: '', symbol: '', unit: '', rms: 0, peak: 0, recorded, simulated: recorded, difference })

test('the default tolerance is a hundredth of the recorded range', () => {
  expect(defaultTolerance(trace([[-1, null, 0], [0, null, 3]]))).toBeCloseTo(0.04)
  expect(defaultTolerance(trace([[null], [null]]))).toBe(0)
})

test('the share outside counts both signs and leaves out gaps', () => {
  const one = trace([[0], [0]], [[-2, -0.1, null, 0], [0, 0.1, null, 2]])
  expect(shareOutside(one, 1)).toBeCloseTo(2 / 3)
  expect(shareOutside(one, 2)).toBe(0)
})

test('a view begins where the set-point begins to change', () => {
  expect(begin([0, 1, 2], trace([[0, 0, 0.1], [0, 0, 0.4]]))).toBe(2)
  expect(begin([0, 1], trace([[3, 3], [3, 3]]))).toBe(null)
  expect(begin([0], undefined)).toBe(null)
})
