import { expect, test } from 'vitest'
import { nearest, nearestPoint, nearestStep, without } from '../src/controller/draft'
import { lines, magnitude, poles, reach, stops } from '../src/controller/series'
import type { LoopAt, LoopView } from '../src/protocol'

const mark = { name: 'gain margin', text: 'gain margin 4.00 at 60.0 Hz', short: 'GM 4.00', frequency: 60, decibels: -12, phase: -180, real: -0.25, imaginary: 0 }
const pole = (real: number, imaginary: number) => ({ real, imaginary, frequency: Math.hypot(real, imaginary), damping: 1 })
const at = (load: string): LoopAt => ({
  load, stable: true, numbers: [], poles: [pole(-3, 4), pole(-3, -4)], plant: [pole(-1, 0)], frequency: [1, 10, 100], decibels: [40, 0, -40], phase: [-90, -120, -200],
  real: [0, -0.5, -0.01], imaginary: [-100, -0.8, 0], marks: [mark], time: [0, 1], setpoint: [0, 1], overshoot: 0, disturbed: [0, 0],
})
const loop = { loads: [at('sliding'), at('stuck')] } as LoopView

test('a new choice discards the changes below the previous one', () => {
  const values = { 'a.regulator.angle': '1', 'a.regulator.velocity': '2', 'a.torque': '3' }
  expect(without(values, 'a.torque', '4')).toEqual({ ...values, 'a.torque': '4' })
  expect(without(values, 'a.regulator.kind', 'poles')).toEqual({ 'a.torque': '3', 'a.regulator.kind': 'poles' })
})

test('edits of one field within a short time are one undo step', () => {
  const step = { key: 'gain' }
  const first = nearestStep([], step, 0, 5000)
  expect(nearestStep(first.past, step, first.last, 5500).past).toHaveLength(1)
  expect(nearestStep(first.past, step, first.last, 9000).past).toHaveLength(2)
  expect(nearestStep(first.past, { key: 'other' }, first.last, 5500).past).toHaveLength(2)
  expect(nearestStep(Array.from({ length: 100 }, () => step), step, 0, 9000).past).toHaveLength(100)
})

test('the cursor selects the nearest frequency or the nearest point of the plane', () => {
  expect(nearest([1, 10, 100], 20)).toBe(1)
  expect(nearestPoint([0, -0.5, -0.01], [-100, -0.8, 0], { x: -0.6, y: -0.7 })).toBe(1)
})

test('a draft is drawn over the target in grey, for the selected loads', () => {
  expect(lines(loop, null, 'both', magnitude).map((one) => one.role)).toEqual(['trace-1', 'trace-2'])
  expect(lines(loop, loop, 'stuck', magnitude).map((one) => [one.role, one.name])).toEqual([['measured', 'Target'], ['trace-2', 'Stuck']])
  expect(lines(null, null, 'both', magnitude)).toEqual([])
})

test('only poles of the upper half plane are drawn; margins have labels and lines', () => {
  const [plant, closed] = poles(loop, 'sliding')
  expect([plant!.x, closed!.x, closed!.y]).toEqual([[-1], [-3], [4]])
  expect(stops(loop, 'sliding', (one) => [one.frequency, one.decibels])).toEqual([{ x: 60, y: -12, text: 'load sliding: gain margin 4.00 at 60.0 Hz' }])
  expect(reach(loop, 'both', 'gain margin', 0, (one) => one.decibels)[0]).toMatchObject({ x: [60, 60], y: [0, -12] })
  expect(reach(loop, 'both', 'delay margin', 0, (one) => one.decibels)).toEqual([])
})
