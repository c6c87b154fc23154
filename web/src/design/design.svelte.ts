// The draft of the desired friction: curve, answers of the program, undo and redo.
// The program computes everything: one request is in flight, the newest draft is sent next.

import { bench } from '../bench.svelte'
import { Refused } from '../connection'
import { measurement, type Offer } from '../measurement.svelte'
import type { Drag, Drawn, Reference, ChatterMargin } from '../protocol'
import { weakest } from './limits'

type Four = [number, number, number, number]
type Three = [number, number, number]
/** The draft. `follow`: the curve is fitted to the points. */
export type Draft = { desired: Four; bristles: Three; points: Reference[]; follow: boolean; law: string }
export type Tool = 'shape' | 'point' | 'pan'
type Step = { draft: Draft; name: string; key: string }
type Request = { drag?: Drag; nearest?: boolean; fit?: boolean; draft: Draft; done?: (drawn: Drawn) => void }

/** Paths of the numbers of a draft. */
export const CURVE = ['breakaway_torque', 'kinetic_torque', 'stribeck_velocity', 'viscous_friction'].map((name) => `bench.desired.${name}`)
export const BRISTLES = ['stiffness', 'damping', 'elastic_fraction'].map((name) => `bench.desired_bristles.${name}`)
export const OWN = CURVE.map((path) => path.replace('bench.desired', 'model.own'))
export const LAW = 'bench.law.kind'
/** Pause of the input before the slow computations start [ms]. */
const PAUSE = 250
/** Edits of the same handle within this time are one undo step [ms]. */
const TOGETHER = 1200
const STEPS = 100
/** Number of points from which the curve is fitted to them. */
export const ENOUGH = 2

/** A number for the parameter file, six significant digits. */
export const written = (value: number) => String(Number(value.toPrecision(6)))

class DesignState {
  draft = $state.raw<Draft | null>(null)
  drawn = $state.raw<Drawn | null>(null)
  /** Speeds of `drawn` [rad/s]. */
  speeds = $state.raw<number[]>([])
  /** The curve at the start of the drag. */
  ghost = $state.raw<{ drawn: Drawn; speeds: number[] } | null>(null)
  margin = $state.raw<ChatterMargin | null>(null)
  /** True while the margin does not belong to the displayed curve. */
  checking = $state(true)
  refused = $state('')
  wrong = $state('')
  /** True after a download since the page was opened. */
  downloaded = $state(false)
  tool = $state<Tool>('shape')
  offered = $state.raw<Omit<Offer, 'run'> | null>(null)
  past = $state.raw<Step[]>([])
  future = $state.raw<Step[]>([])
  #grid: number[] = []
  #busy = false
  #next: Request | null = null
  #last = 0
  #timer = 0
  #key = ''
  #active = ''

  /** The desired friction on the target. */
  active = $derived.by((): Draft | null => {
    const numbers = (paths: string[]) => paths.map((path) => bench.item(path)?.value ?? NaN)
    const law = bench.item(LAW)?.choice
    if (!law) return null
    return { desired: numbers(CURVE) as Four, bristles: numbers(BRISTLES) as Three, points: [], follow: false, law }
  })
  /** Values to download, by path. */
  values = $derived.by((): Record<string, string> => {
    const { draft, active } = this
    if (!draft || !active) return {}
    const all: Record<string, string> = {}
    CURVE.forEach((path, i) => written(draft.desired[i]!) !== written(active.desired[i]!) && (all[path] = written(draft.desired[i]!)))
    BRISTLES.forEach((path, i) => written(draft.bristles[i]!) !== written(active.bristles[i]!) && (all[path] = written(draft.bristles[i]!)))
    if (draft.law !== active.law) all[LAW] = draft.law
    return all
  })
  changes = $derived(Object.keys(this.values).length)
  /** The nearest of all limits of the draft. */
  nearestLimit = $derived(weakest(this.drawn?.nearest, this.margin, bench.speedUnit))
  /** The reason why the draft cannot be downloaded; null if it can. */
  off = $derived.by((): string | null => {
    if (bench.busy) return bench.busy
    if (!this.changes) return 'The target has this friction'
    if (this.wrong) return this.wrong
    if (this.drawn && !this.drawn.renderable) return 'Not renderable'
    if (!this.checking && this.refused) return this.refused
    return !this.checking && this.margin?.stable === false ? 'Refused: chatter predicted' : null
  })

  /** Loads the draft of this project, or the desired friction on the target. */
  start() {
    const { active } = this
    if (!active || Number.isNaN(active.desired[0])) return
    const key = `stickslip.design.${location.host}.${bench.status?.preset ?? ''}`
    const now = JSON.stringify(active)
    if (!bench.status || (key === this.#key && now === this.#active)) return
    const untouched = this.draft !== null && this.#active === JSON.stringify(this.draft)
    if (key !== this.#key) this.draft = storedDraft(key) ?? active
    else if (untouched) this.draft = active
    ;[this.#key, this.#active] = [key, now]
    this.draw()
  }

  /** The speed grid of the plot [rad/s]. */
  sample(speeds: number[]) {
    if (speeds.length === this.#grid.length && speeds.every((speed, i) => speed === this.#grid[i])) return
    this.#grid = speeds
    this.draw()
  }

  /** Requests the curve of the draft. */
  draw() {
    if (this.draft) this.#send({ draft: this.draft })
  }

  /** Drags the curve; `from` is the draft at the start of the drag. */
  drag(from: Draft, drag: Drag, done?: (drawn: Drawn) => void) {
    this.#send({ draft: { ...from, follow: from.follow && (drag.refit ?? false) }, drag, done })
  }

  /** Changes numbers, as an undo step. */
  change(change: Partial<Draft>, name: string, key = name) {
    if (!this.draft) return
    this.note(this.draft, name, key)
    this.set(change)
  }

  /** As `change`, within the current undo step. */
  set(change: Partial<Draft>) {
    if (!this.draft) return
    this.draft = { ...this.draft, ...change }
    this.#send({ draft: this.draft, fit: this.draft.follow && this.draft.points.length >= ENOUGH })
  }

  setPoints(points: Reference[], name: string, key = name, follow = this.draft?.follow || !this.draft?.points.length) {
    this.change({ points, follow: follow && points.length > 0 }, name, key)
  }

  /** Adds a reference point; points set at different times are steps of their own. */
  addPoint(speed: number, torque: number, time: number) {
    const point = { speed: Math.max(0, speed), torque: Math.max(1e-6, torque), weight: 1 }
    this.setPoints([...(this.draft?.points ?? []), point], 'Point set', `${time}`)
  }

  fit() {
    if (this.draft?.points.length) this.change({ follow: true }, 'Fit to points')
  }

  nearest() {
    const { draft } = this
    if (!draft) return
    this.note(draft, 'Nearest renderable')
    this.#send({ draft: { ...draft, follow: false }, nearest: true })
  }

  /** Starts an undo step with the previous draft. */
  note(draft: Draft, name: string, key = name) {
    const last = this.past.at(-1)
    const same = last?.key === key && Date.now() - this.#last < TOGETHER
    this.#last = Date.now()
    this.future = []
    if (!same) this.past = [...this.past.slice(1 - STEPS), { draft, name, key }]
  }

  /** Names the current undo step. */
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
    if (!step || !this.draft) return
    this[from] = this[from].slice(0, -1)
    this[to] = [...this[to], { ...step, draft: this.draft }]
    this.draft = step.draft
    this.#last = 0
    this.draw()
  }

  /** Shows the changes of a download. */
  async offer() {
    const { values, off } = this
    if (off) return bench.warn(off)
    try {
      const [{ differences }, margin] = await Promise.all([
        bench.connection.call({ call: 'preview', values }, 'differences'),
        bench.connection.call({ call: 'margin', values }, 'margin'),
      ])
      this.offered = { values, changes: differences, margin, refused: null, nearest: this.drawn?.nearest }
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(error.message)
    }
  }

  async download() {
    const values = this.offered?.values
    if (values && (await bench.apply(values, 'Desired friction', { name: 'Measure again (axis moves)', run: () => void measurement.measureRendered() }))) this.downloaded = true
    this.offered = null
  }

  #send(request: Request) {
    // The last command is kept if a newer drag position replaces the request.
    this.#next = { ...request, done: request.done ?? this.#next?.done }
    this.checking = true
    if (!this.#busy) void this.#fly()
  }

  async #fly() {
    this.#busy = true
    clearTimeout(this.#timer)
    while (this.#next && this.#grid.length && bench.connection.open) {
      const request = this.#next
      const speeds = this.#grid
      this.#next = null
      try {
        const drawn = await bench.connection.call(this.#sketch(request, speeds, false), 'drawn')
        this.wrong = ''
        // Values changed meanwhile are newer than this answer.
        const newer = this.#next as Request | null
        if (!newer || newer.drag) this.draft = { ...request.draft, desired: drawn.desired }
        ;[this.drawn, this.speeds] = [{ ...drawn, answer: undefined } as Drawn, speeds]
        request.done?.(drawn)
      } catch (error) {
        if (!(error instanceof Refused)) throw error
        this.wrong = error.message
      }
    }
    this.#busy = false
    this.#timer = window.setTimeout(() => void this.#check(), PAUSE)
  }

  #sketch({ draft, drag, nearest, fit }: Request, speeds: number[], thorough: boolean) {
    const { desired, bristles, points } = draft
    return { call: 'sketch', desired, bristles, points, fit: fit ?? false, drag: drag ?? null, nearest: nearest ?? false, thorough, speeds } as const
  }

  /** After a pause of the input: reasons, margin, storage of the draft. */
  async #check() {
    const { draft } = this
    if (!draft || this.#busy) return
    storeDraft(this.#key, draft)
    const values = this.values
    const [drawn, margin] = await Promise.allSettled([
      bench.connection.call(this.#sketch({ draft }, this.#grid, true), 'drawn'),
      bench.connection.call({ call: 'margin', values }, 'margin'),
    ])
    if (this.draft !== draft || this.#busy) return
    if (drawn.status === 'fulfilled') this.drawn = drawn.value
    this.margin = margin.status === 'fulfilled' ? margin.value : null
    this.refused = margin.status === 'rejected' && margin.reason instanceof Refused ? margin.reason.message : ''
    this.checking = false
  }
}

function storedDraft(key: string): Draft | null {
  try {
    const stored = JSON.parse(localStorage.getItem(key) ?? 'null') as Draft | null
    return stored && stored.desired.length === CURVE.length && stored.bristles.length === BRISTLES.length ? stored : null
  } catch {
    return null
  }
}

function storeDraft(key: string, draft: Draft) {
  try {
    localStorage.setItem(key, JSON.stringify(draft))
  } catch {
    // Without storage in the browser, the draft is lost on reload.
  }
}

export const design = new DesignState()
