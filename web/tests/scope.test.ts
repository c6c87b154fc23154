import { expect, test } from 'vitest'
import { frame, type Frame } from '../src/scope/frames'
import { steps } from '../src/scope/draw'
import { read, Unreadable } from '../src/scope/formula'
import { Chunk } from '../src/scope/past'
import { Ring } from '../src/scope/ring'
import { packed, ringOf, unpacked } from '../src/scope/samples'
import { peak, spectrum } from '../src/scope/spectrum'
import { crossing } from '../src/scope/trigger'

function bytes(from: number, missing: number, columns: number[][]): ArrayBuffer {
  const rows = columns[0]!.length
  const buffer = new ArrayBuffer(32 + 8 * rows * columns.length)
  const head = new DataView(buffer)
  ;[7, from, missing].forEach((word, i) => head.setBigUint64(8 * i, BigInt(word), true))
  head.setUint32(24, rows, true)
  head.setUint32(28, columns.length, true)
  columns.flat().forEach((value, i) => head.setFloat64(32 + 8 * i, value, true))
  return buffer
}

const batch = (from: number, missing: number, columns: number[][]): Frame => frame(bytes(from, missing, columns))

test('a binary message is read in place', () => {
  const read = batch(5_000_000_000, 3, [[1, 2], [-1, -2]])
  expect([read.stream, read.from, read.missing, read.rows, [...read.values]]).toEqual([7, 5_000_000_000, 3, 2, [1, 2, -1, -2]])
})

test('each cycle is delivered or missing, and the extremes of a span are those of its samples', () => {
  // A ring of 128 cycles.
  const ring = new Ring(1, 1000, 128 * 9)
  expect(ring.room).toBe(128)
  const known = new Map<number, number>()
  let seed = 1
  const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647
  let next = 41
  for (let i = 0; i < 200; i++) {
    const missing = random() < 0.2 ? Math.floor(random() * 90) : 0
    const rows = 1 + Math.floor(random() * 50)
    const values = Array.from({ length: rows }, () => (random() < 0.02 ? NaN : Math.round(random() * 100)))
    const from = next + missing
    ring.write(batch(from, missing, [values]))
    values.forEach((value, k) => known.set(from + k, value))
    next = from + rows
    expect(ring.next).toBe(next)
    expect(ring.delivered + ring.missing).toBe(next - 41)
    for (let k = 0; k < 5; k++) {
      const [a, step] = [ring.first - 5 + random() * 100, random() * 90]
      const [low, high] = [new Float64Array(3), new Float64Array(3)]
      ring.extremes(0, a, step, 3, low, high)
      for (let column = 0; column < 3; column++) {
        const inside = []
        for (let cycle = Math.max(ring.first, Math.ceil(a + column * step)); cycle < Math.min(next, Math.ceil(a + (column + 1) * step)); cycle++) inside.push(known.get(cycle) ?? NaN)
        const numbers = inside.filter((value) => !Number.isNaN(value))
        expect([low[column], high[column]]).toEqual(numbers.length ? [Math.min(...numbers), Math.max(...numbers)] : [NaN, NaN])
      }
    }
  }
  expect(ring.gaps.length).toBeGreaterThan(0)
})

test('a gap longer than the ring is one gap, and frames after a restart do not fit', () => {
  const ring = new Ring(2, 64, 1e9)
  ring.write(batch(10, 0, [[1, 2], [3, 4]]))
  ring.write(batch(100_012, 100_000, [[5], [6]]))
  expect([ring.missing, ring.gaps, ring.value(0, 100_012), ring.value(0, 100_011)]).toEqual([100_000, [{ from: 12, cycles: 100_000 }], 5, NaN])
  expect(ring.fits(batch(3, 0, [[1], [2]]))).toBe(false)
  expect(ring.fits(batch(100_013, 0, [[1]]))).toBe(false)
})

test('statistics between two cycles stay precise with a large mean', () => {
  const ring = new Ring(1, 1000)
  ring.write(batch(0, 0, [[1e9 + 1, 1e9 - 1, 1e9 + 1, 1e9 - 1]]))
  expect(ring.statistics(0, 0, 3)).toMatchObject({ count: 4, mean: 1e9, least: 1e9 - 1, largest: 1e9 + 1 })
})

test('an event is the first sample beyond the level with the selected slope', () => {
  const ring = new Ring(1, 1000)
  ring.write(batch(100, 0, [[0, 1, 2, NaN, 2, 0, -1, 1]]))
  const found = (level: number, slope: 'rising' | 'falling' | 'either', from = 100) => crossing(ring, 0, from, ring.next, level, slope)
  expect([found(2, 'rising'), found(0.5, 'falling'), found(0.5, 'either'), found(0.5, 'either', 103)]).toEqual([102, 105, 101, 105])
  // No event at a non-finite value, before the first sample, or at a mere touch from the level.
  expect([found(2, 'rising', 103), found(5, 'either'), found(0, 'rising', 107)]).toEqual([null, null, 107])
})

test('a range contains the data and is kept while it fits', () => {
  const first = steps([-1, 1], null)
  expect(first[0]).toBeLessThanOrEqual(-1)
  expect(first[1]).toBeGreaterThanOrEqual(1)
  expect(steps([-0.9, 1], first)).toBe(first)
  expect(steps([-3, 1], first)[0]).toBeLessThanOrEqual(-3)
  expect(steps([0, 0.01], first)[1]).toBeLessThan(0.1)
  const still = steps([5, 5], null)
  expect(still[0] < 5 && still[1] > 5).toBe(true)
  expect(steps(null, first)).toBe(first)
})

const context = { index: (name: string) => ['angle', 'setpoint.velocity'].indexOf(name), rate: 1000 }

test('a computed channel follows its formula in each cycle, also for older cycles', () => {
  const formula = read('slip = (setpoint.velocity - 2 * angle^2) / max(abs(angle), pi)', context)
  expect(formula.name).toBe('slip')
  const value = (a: number, v: number) => (v - 2 * a ** 2) / Math.max(Math.abs(a), Math.PI)
  // A ring of 128 cycles, several times around.
  const [early, late] = [new Ring(2, 1000, 2 * 128 * 9), new Ring(2, 1000, 2 * 128 * 9)]
  early.derive([formula.start, read('d(angle)', context).start])
  for (const ring of [early, late]) {
    for (let i = 0, from = 5; i < 40; i++) {
      const missing = i % 7 === 6 ? 20 : 0
      from += missing
      const cycles = Array.from({ length: 13 }, (_, k) => from + k)
      ring.write(batch(from, missing, [cycles.map(Math.sin), cycles.map(Math.cos)]))
      from += 13
    }
  }
  late.derive([formula.start, read('d(angle)', context).start])
  const [low, high] = [new Float64Array(1), new Float64Array(1)]
  for (const ring of [early, late]) {
    const seen: number[] = []
    for (let cycle = ring.first; cycle < ring.next; cycle++) {
      const [a, v, slip, slope] = [0, 1, 2, 3].map((column) => ring.value(column, cycle)) as [number, number, number, number]
      if (Number.isNaN(a)) expect([slip, slope]).toEqual([NaN, NaN])
      else {
        expect(slip).toBe(value(a, v))
        seen.push(slip)
        // No derivative across a gap or in the first cycle.
        const before = cycle > ring.first ? ring.value(0, cycle - 1) : NaN
        if (!Number.isNaN(before)) expect(slope).toBe((a - before) * 1000)
        else if (cycle > ring.first) expect(slope).toBe(NaN)
      }
    }
    ring.extremes(2, ring.first, ring.next - ring.first, 1, low, high)
    expect([low[0], high[0]]).toEqual([Math.min(...seen), Math.max(...seen)])
  }
})

test('a low pass passes slow signals and attenuates fast ones', () => {
  const ring = new Ring(2, 1000)
  ring.derive([read('lowpass(angle, 10)', context).start])
  const wave = (hertz: number) => Array.from({ length: 4000 }, (_, k) => Math.sin((2 * Math.PI * hertz * k) / 1000))
  ring.write(batch(0, 0, [wave(100), wave(1)]))
  const { amplitudes, step } = spectrum(ring, 2, 0, 3999, 1000)!
  // First order: with a step of 1 ms at a tenth of the rate, within one percent.
  const pole = Math.exp(-2 * Math.PI * 0.01)
  const [re, im] = [1 - pole * Math.cos(0.2 * Math.PI), pole * Math.sin(0.2 * Math.PI)]
  expect(peak({ amplitudes, step })!.amplitude).toBeCloseTo((1 - pole) / Math.hypot(re, im), 2)
})

test('an invalid formula gives a clear message', () => {
  const wrong = (text: string) => {
    try {
      read(text, context)
    } catch (error) {
      if (error instanceof Unreadable) return error.message
    }
    return 'read'
  }
  expect(wrong('speed + 1')).toContain('unknown signal speed')
  expect(wrong('angle +')).toContain('Syntax error')
  expect(wrong('median(angle)')).toContain('unknown function median()')
  expect(wrong('constructor(angle)')).toContain('unknown function constructor()')
  expect(wrong('max(angle)')).toContain('requires 2 values')
  expect(wrong('angle; angle')).toContain('single formula')
  expect(wrong('angle % 2')).toContain('unknown operator %')
  expect(wrong(' ')).toContain('Enter a formula')
  expect(wrong('"angle"')).toContain('is not a number')
})

test('the spectrum of a sine shows its frequency and amplitude, also between two lines and with a mean', () => {
  const ring = new Ring(1, 1000)
  ring.write(batch(0, 0, [Array.from({ length: 5000 }, (_, k) => 7 + 0.3 * Math.sin((2 * Math.PI * 12.34 * k) / 1000))]))
  const found = peak(spectrum(ring, 0, 0, 4999, 1000)!)!
  expect(found.frequency).toBeCloseTo(12.34, 2)
  // Except for leakage from the mirror image.
  expect(Math.abs(found.amplitude / 0.3 - 1)).toBeLessThan(1e-4)
  ring.write(batch(5010, 10, [[0, 0]]))
  expect(spectrum(ring, 0, 0, 5011, 1000)).toBeNull()
  expect(spectrum(ring, 0, 0, 10, 1000)).toBeNull()
})

/** Cycles `from` … `to` − 1 of two signals, without every 50th. */
function fill(ring: Ring, from: number, to: number) {
  for (let cycle = from; cycle < to; cycle++) if (cycle % 50) ring.write(batch(cycle, 0, [[cycle], [-cycle]]))
}

test('after a hold the buffer continues with the cycles that arrived meanwhile', () => {
  const held = new Ring(2, 1000, Infinity, 512)
  fill(held, 1001, 1300)
  const live = new Ring(2, 1000, Infinity, 512)
  fill(live, 1301, 1400)
  expect(held.append(live)).toBe(true)
  expect([held.first, held.next]).toEqual([1001, 1400])
  for (let cycle = 1001; cycle < 1400; cycle++) expect(held.value(1, cycle)).toBe(cycle % 50 ? -cycle : NaN)
  // Cycles before the first received one are missing, too.
  expect(held.gaps.map((gap) => gap.from)).toEqual([1050, 1100, 1150, 1200, 1250, 1300, 1350])
  // A restarted bench counts its cycles from zero.
  const restarted = new Ring(2, 1000, Infinity, 512)
  fill(restarted, 1, 90)
  expect(held.append(restarted)).toBe(false)
})

test('older cycles have the extremes of the history, the finest that covers them', () => {
  const ring = new Ring(2, 1000, Infinity, 256)
  fill(ring, 1001, 1101)
  const whole = new Chunk([0], { from: 0, block: 256, low: [[0, 250, 500, 700, 990]], high: [[255, 511, 900, 999, 1100]] })
  const near = new Chunk([0], { from: 768, block: 16, low: [[768, null, 800]], high: [[783, null, 815]] })
  ring.past = [near, whole]
  const [low, high] = [new Float64Array(4), new Float64Array(4)]
  ring.extremes(0, 768, 16, 4, low, high)
  expect([...low]).toEqual([768, NaN, 800, NaN])
  ring.extremes(0, 256, 256, 4, low, high)
  expect([[...low], [...high]]).toEqual([[250, 500, 700, 1024], [511, 900, 1023, 1099]])
  // Only the extremes are there: no values, and no statistics.
  expect(ring.value(0, 900)).toBeNaN()
  expect(ring.statistics(0, 900, 1050).count).toBe(0)
  expect(ring.statistics(0, 1010, 1019).count).toBe(10)
  ring.extremes(1, 256, 256, 2, low, high)
  expect([...low.slice(0, 2)]).toEqual([NaN, NaN])
})

test('samples of a capture read back as they were sent', async () => {
  const ring = new Ring(2, 1000, Infinity, 512)
  fill(ring, 1001, 1300)
  const signal = (name: string) => ({ name, label: name, symbol: '', unit: 'rad', printed_unit: 'rad', help: '', values: [] })
  const signals = ['one', 'two'].map(signal)
  const body = packed(ring, signals.map((signal, index) => ({ signal, index })), 1040, 1200, 1000, 1100)!
  const read = unpacked(await body.arrayBuffer())
  expect([read.rate, read.trigger, read.cycles.length, read.cycles[0]]).toEqual([1000, 1100, 157, 1040])
  const again = ringOf(read, [signal('two'), signal('three')])
  expect([again.first, again.next]).toEqual([1040, 1200])
  expect([again.value(0, 1041), again.value(0, 1050), again.value(1, 1041)]).toEqual([-1041, NaN, NaN])
  expect(packed(ring, [], 5000, 6000, 1000, null)).toBeNull()
})
