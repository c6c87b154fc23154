// The desired friction that is being drawn: what the hand holds, what the program says to it, and the way back.
// All mathematics is the program's: one request is in flight, the newest position of the hand wins.

import { bench } from '../bench.svelte'
import { Refused } from '../connection'
import { measurement, type Offer } from '../measurement.svelte'
import type { Drag, Drawn, Reference, ChatterMargin } from '../protocol'

type Four = [number, number, number, number]
type Three = [number, number, number]
/** What the hand holds. `follow`: the curve is laid through the points. */
export type Hand = { desired: Four; bristles: Three; points: Reference[]; follow: boolean; law: string }
export type Tool = 'shape' | 'point' | 'pan'
type Step = { hand: Hand; name: string; key: string }
type Ask = { drag?: Drag; nearest?: boolean; fit?: boolean; hand: Hand; done?: (drawn: Drawn) => void }

/** Where the numbers of a hand are in the parameters. */
export const CURVE = ['breakaway_torque', 'kinetic_torque', 'stribeck_velocity', 'viscous_friction'].map((name) => `bench.desired.${name}`)
export const BRISTLES = ['stiffness', 'damping', 'elastic_fraction'].map((name) => `bench.desired_bristles.${name}`)
export const OWN = CURVE.map((path) => path.replace('bench.desired', 'model.own'))
export const LAW = 'bench.law.kind'
/** The hand rests after this time [ms]: then comes what takes longer. */
const REST = 250
/** Keys of the same handle within this time are one step of undo [ms]. */
const TOGETHER = 1200
const STEPS = 100
/** Points from which on the curve follows them. */
export const ENOUGH = 2

/** A number as it goes into a file: no more digits than a hand can mean. */
export const written = (value: number) => String(Number(value.toPrecision(6)))

class DesignState {
  hand = $state.raw<Hand | null>(null)
  drawn = $state.raw<Drawn | null>(null)
  /** Speeds of `drawn` [rad/s]. */
  speeds = $state.raw<number[]>([])
  /** As it was when the drag began. */
  ghost = $state.raw<{ drawn: Drawn; speeds: number[] } | null>(null)
  margin = $state.raw<ChatterMargin | null>(null)
  /** The margin is not that of the curve that is shown. */
  checking = $state(true)
  refused = $state('')
  wrong = $state('')
  /** A design has been downloaded since the page is open. */
  downloaded = $state(false)
  tool = $state<Tool>('shape')
  offered = $state.raw<Omit<Offer, 'run'> | null>(null)
  past = $state.raw<Step[]>([])
  future = $state.raw<Step[]>([])
  #grid: number[] = []
  #flying = false
  #next: Ask | null = null
  #last = 0
  #rest = 0
  #key = ''
  #force = ''

  /** What is in force. */
  force = $derived.by((): Hand | null => {
    const numbers = (paths: string[]) => paths.map((path) => bench.item(path)?.value ?? NaN)
    const law = bench.item(LAW)?.choice
    if (!law) return null
    return { desired: numbers(CURVE) as Four, bristles: numbers(BRISTLES) as Three, points: [], follow: false, law }
  })
  /** What is to be downloaded: value by path. */
  values = $derived.by((): Record<string, string> => {
    const { hand, force } = this
    if (!hand || !force) return {}
    const all: Record<string, string> = {}
    CURVE.forEach((path, i) => written(hand.desired[i]!) !== written(force.desired[i]!) && (all[path] = written(hand.desired[i]!)))
    BRISTLES.forEach((path, i) => written(hand.bristles[i]!) !== written(force.bristles[i]!) && (all[path] = written(hand.bristles[i]!)))
    if (hand.law !== force.law) all[LAW] = hand.law
    return all
  })
  changes = $derived(Object.keys(this.values).length)
  /** Why it cannot be downloaded; null where it can. */
  off = $derived.by((): string | null => {
    if (bench.busy) return bench.busy
    if (!this.changes) return 'The desired friction is in force'
    if (this.wrong) return this.wrong
    if (this.drawn && !this.drawn.renderable) return 'Not renderable'
    if (!this.checking && this.refused) return this.refused
    return !this.checking && this.margin?.stable === false ? 'Refused: it would chatter' : null
  })

  /** Takes up the draft of this project, or what is in force. */
  begin() {
    const { force } = this
    if (!force || Number.isNaN(force.desired[0])) return
    const key = `stickslip.design.${location.host}.${bench.status?.preset ?? ''}`
    const now = JSON.stringify(force)
    if (!bench.status || (key === this.#key && now === this.#force)) return
    const untouched = this.hand !== null && this.#force === JSON.stringify(this.hand)
    if (key !== this.#key) this.hand = draft(key) ?? force
    else if (untouched) this.hand = force
    ;[this.#key, this.#force] = [key, now]
    this.draw()
  }

  /** The grid of the plot [rad/s]. */
  sample(speeds: number[]) {
    if (speeds.length === this.#grid.length && speeds.every((speed, i) => speed === this.#grid[i])) return
    this.#grid = speeds
    this.draw()
  }

  /** Draws the hand as it is. */
  draw() {
    if (this.hand) this.#send({ hand: this.hand })
  }

  /** A hand on the curve: `from` is what it was when the drag began. */
  drag(from: Hand, drag: Drag, done?: (drawn: Drawn) => void) {
    this.#send({ hand: { ...from, follow: from.follow && (drag.refit ?? false) }, drag, done })
  }

  /** Other numbers, at once. */
  change(change: Partial<Hand>, name: string, key = name) {
    if (!this.hand) return
    this.note(this.hand, name, key)
    this.set(change)
  }

  /** As `change`, within a step of undo. */
  set(change: Partial<Hand>) {
    if (!this.hand) return
    this.hand = { ...this.hand, ...change }
    this.#send({ hand: this.hand, fit: this.hand.follow && this.hand.points.length >= ENOUGH })
  }

  setPoints(points: Reference[], name: string, key = name, follow = this.hand?.follow || !this.hand?.points.length) {
    this.change({ points, follow: follow && points.length > 0 }, name, key)
  }

  fit() {
    if (this.hand?.points.length) this.change({ follow: true }, 'Fit to points')
  }

  nearest() {
    const { hand } = this
    if (!hand) return
    this.note(hand, 'Nearest renderable')
    this.#send({ hand: { ...hand, follow: false }, nearest: true })
  }

  /** A step that can be undone begins: the hand before it. */
  note(hand: Hand, name: string, key = name) {
    const last = this.past.at(-1)
    const same = last?.key === key && Date.now() - this.#last < TOGETHER
    this.#last = Date.now()
    this.future = []
    if (!same) this.past = [...this.past.slice(1 - STEPS), { hand, name, key }]
  }

  /** Names the newest step. */
  name(name: string) {
    const last = this.past.at(-1)
    if (last) this.past = [...this.past.slice(0, -1), { ...last, name, key: name }]
  }

  undo() {
    this.#step('past', 'future')
  }

  redo() {
    this.#step('future', 'past')
  }

  #step(from: 'past' | 'future', to: 'past' | 'future') {
    const step = this[from].at(-1)
    if (!step || !this.hand) return
    this[from] = this[from].slice(0, -1)
    this[to] = [...this[to], { ...step, hand: this.hand }]
    this.hand = step.hand
    this.#last = 0
    this.draw()
  }

  /** What the download would change. */
  async offer() {
    const { values, off } = this
    if (off) return bench.warn(off)
    try {
      const [{ differences }, margin] = await Promise.all([
        bench.connection.call({ call: 'preview', values }, 'differences'),
        bench.connection.call({ call: 'margin', values }, 'margin'),
      ])
      this.offered = { values, changes: differences, margin, refused: null }
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(error.message)
    }
  }

  async download() {
    const values = this.offered?.values
    this.offered = null
    if (values && (await bench.enter(values, 'Desired friction', { name: 'Measure again, the axis moves', run: () => void measurement.again() }))) this.downloaded = true
  }

  #send(ask: Ask) {
    // What was done last stays, although a newer position of the hand overtakes it.
    this.#next = { ...ask, done: ask.done ?? this.#next?.done }
    this.checking = true
    if (!this.#flying) void this.#fly()
  }

  async #fly() {
    this.#flying = true
    clearTimeout(this.#rest)
    while (this.#next && this.#grid.length && bench.connection.open) {
      const ask = this.#next
      const speeds = this.#grid
      this.#next = null
      try {
        const drawn = await bench.connection.call(this.#sketch(ask, speeds, false), 'drawn')
        this.wrong = ''
        // What was changed meanwhile is newer than this answer.
        const newer = this.#next as Ask | null
        if (!newer || newer.drag) this.hand = { ...ask.hand, desired: drawn.desired }
        ;[this.drawn, this.speeds] = [{ ...drawn, answer: undefined } as Drawn, speeds]
        ask.done?.(drawn)
      } catch (error) {
        if (!(error instanceof Refused)) throw error
        this.wrong = error.message
      }
    }
    this.#flying = false
    this.#rest = window.setTimeout(() => void this.#rested(), REST)
  }

  #sketch({ hand, drag, nearest, fit }: Ask, speeds: number[], thorough: boolean) {
    const { desired, bristles, points } = hand
    return { call: 'sketch', desired, bristles, points, fit: fit ?? false, drag: drag ?? null, nearest: nearest ?? false, thorough, speeds } as const
  }

  /** The hand rests: reasons, margin, draft. */
  async #rested() {
    const { hand } = this
    if (!hand || this.#flying) return
    keep(this.#key, hand)
    const values = this.values
    const [drawn, margin] = await Promise.allSettled([
      bench.connection.call(this.#sketch({ hand }, this.#grid, true), 'drawn'),
      bench.connection.call({ call: 'margin', values }, 'margin'),
    ])
    if (this.hand !== hand || this.#flying) return
    if (drawn.status === 'fulfilled') this.drawn = drawn.value
    this.margin = margin.status === 'fulfilled' ? margin.value : null
    this.refused = margin.status === 'rejected' && margin.reason instanceof Refused ? margin.reason.message : ''
    this.checking = false
  }
}

function draft(key: string): Hand | null {
  try {
    const found = JSON.parse(localStorage.getItem(key) ?? 'null') as Hand | null
    return found && found.desired.length === CURVE.length && found.bristles.length === BRISTLES.length ? found : null
  } catch {
    return null
  }
}

function keep(key: string, hand: Hand) {
  try {
    localStorage.setItem(key, JSON.stringify(hand))
  } catch {
    // A browser that stores nothing forgets the draft.
  }
}

export const design = new DesignState()
