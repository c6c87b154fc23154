// The draft of the position controller: changed values, the answers of the program, undo and redo.
// One request is in flight and the newest draft is sent next; slow computations start after a pause of the input.

import { bench, store, stored } from '../bench.svelte'
import { Refused } from '../connection'
import type { Offer } from '../measurement.svelte'
import type { DraftKind, HuntingView, Item, LoopDraft, LoopView, PoleDrag, TuneProgress } from '../protocol'
import { nearestStep, without, type Values } from './draft'

type Step = { values: Values; name: string; key: string }
type Request = { values: Values; kind?: DraftKind; drag?: PoleDrag; overshoot?: number }
/** The load for which curves are shown. */
export type Load = 'both' | 'sliding' | 'stuck'

export const KIND = 'bench.controller.kind'
/** Pause of the input before the slow computations start [ms]. */
const PAUSE = 250
/** Interval between two requests during tuning [ms]. */
const POLL_INTERVAL = 200

class ControllerState {
  /** The draft: values by path that differ from the target. */
  values = $state.raw<Values>({})
  loop = $state.raw<LoopView | null>(null)
  /** The controller on the target. */
  target = $state.raw<LoopView | null>(null)
  /** True while the displayed results are older than the draft. */
  checking = $state(true)
  wrong = $state('')
  hunting = $state.raw<HuntingView | null>(null)
  /** True if the prediction belongs to the draft. */
  predicted = $state(false)
  huntingWrong = $state('')
  /** True: hunting is predicted with the rendered friction, false: with the own friction. */
  desired = $state(false)
  /** Sliding speed of the load [rad/s]. */
  speed = $state(10)
  load = $state<Load>('both')
  /** The frequency under the pointer [Hz]. */
  cursor = $state<number | null>(null)
  tune = $state.raw<TuneProgress | null>(null)
  past = $state.raw<Step[]>([])
  future = $state.raw<Step[]>([])
  offered = $state.raw<Omit<Offer, 'run'> | null>(null)
  #busy = false
  #next: Request | null = null
  #timer = 0
  #last = 0
  #key = ''

  /** Number of differences on the target, including dependent ones. */
  changes = $state(0)
  tuning = $derived(this.tune !== null && !this.tune.ended)
  /** The reason why the draft cannot be changed; null if it can. */
  locked = $derived.by((): string | null => {
    if (!bench.fresh) return bench.blocked
    return this.tuning ? 'Tuning…' : null
  })
  /** The reason why the draft cannot be downloaded; null if it can. */
  off = $derived.by((): string | null => {
    if (bench.busy) return bench.busy
    if (this.tuning) return 'Tuning…'
    if (this.wrong) return this.wrong
    return this.changes ? null : 'The target has these values'
  })

  item(name: string): Item | undefined {
    return this.loop?.items.find((item) => item.path === name)
  }

  /** Loads the draft of this project and the controller on the target. */
  start() {
    const key = `stickslip.controller.${location.host}.${bench.status?.preset ?? ''}`
    if (bench.status && key !== this.#key) {
      this.#key = key
      this.values = storedDraft(key)
    }
    void this.#readTarget()
    this.#send({ values: this.values })
  }

  change(path: string, value: string, name: string) {
    this.note(name, path)
    this.set(without(this.values, path, value))
  }

  set(values: Values) {
    this.values = values
    this.changes = Object.keys(values).length
    this.#send({ values })
  }

  choose(kind: string) {
    this.note(`Controller ${kind}`)
    if (kind === bench.item(KIND)?.choice) this.set(withoutController(this.values))
    else this.#send({ values: this.values, kind: kind as DraftKind })
  }

  /** Moves the desired poles; `from` is the draft at the start of the drag. */
  drag(from: Values, drag: PoleDrag) {
    this.#send({ values: from, drag })
  }

  /** Lowers the set-point weight until a step overshoots by at most this share. */
  limitOvershoot(most: number) {
    this.note(`Overshoot at most ${Math.round(100 * most)} %`)
    this.#send({ values: this.values, overshoot: most })
  }

  setSpeed(speed: number) {
    this.speed = speed
    void this.#readTarget()
    this.#send({ values: this.values })
  }

  setDesired(desired: boolean) {
    this.desired = desired
    this.#later()
  }

  /** Starts an undo step. */
  note(name: string, key = name) {
    const { past, last } = nearestStep(this.past, { values: this.values, name, key }, this.#last, Date.now())
    ;[this.past, this.#last, this.future] = [past, last, []]
    if (this.tune?.ended) this.tune = null
  }

  undo() {
    this.#step('past', 'future')
  }

  redo() {
    this.#step('future', 'past')
  }

  #step(from: 'past' | 'future', to: 'past' | 'future') {
    const step = this[from].at(-1)
    if (!step || this.locked) return
    this[from] = this[from].slice(0, -1)
    this[to] = [...this[to], { ...step, values: this.values }]
    this.#last = 0
    this.set(step.values)
  }

  asOnTarget() {
    if (!this.changes) return
    this.note('As on the target')
    this.set({})
  }

  /** Tunes the draft while the bench keeps running. */
  async automatic() {
    const values = this.values
    try {
      const start = await bench.connection.call({ call: 'tune', values, speed: this.speed }, 'tuned')
      this.tune = start
      while (this.tune && !this.tune.ended) {
        await new Promise((resolve) => setTimeout(resolve, POLL_INTERVAL))
        const now = await bench.connection.call({ call: 'tuned' }, 'tuned')
        if (now.number !== start.number) break
        this.tune = now
      }
      if (this.tune?.ended && this.tune.values) {
        const result = this.tune
        this.note('Automatic tuning')
        this.tune = result
        this.set(result.values as Values)
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.tune = null
      bench.warn(error.message)
    }
  }

  async cancel() {
    await bench.command({ call: 'end_tuning' })
  }

  /** Shows the changes of a download. */
  async offer() {
    const { values, off } = this
    if (off) return bench.warn(off)
    try {
      const { differences } = await bench.connection.call({ call: 'preview', values }, 'differences')
      const verdict = this.checking ? null : this.loop?.verdict
      this.offered = { values, changes: differences, margin: null, refused: verdict && !verdict.fair ? verdict.sentences.join(' ') : null }
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(error.message)
    }
  }

  async download() {
    const values = this.offered?.values
    if (values && (await bench.apply(values, 'Controller'))) this.set({})
    this.offered = null
  }

  #send(request: Request) {
    this.#next = request
    this.checking = true
    this.predicted = false
    if (!this.#busy) void this.#request()
  }

  #draft(request: Request, thorough: boolean): LoopDraft {
    return { values: request.values, kind: request.kind ?? null, drag: request.drag ?? null, overshoot: request.overshoot ?? null, speed: this.speed, thorough }
  }

  async #request() {
    this.#busy = true
    clearTimeout(this.#timer)
    while (this.#next && bench.connection.open) {
      const request = this.#next
      this.#next = null
      try {
        const loop = await bench.connection.call({ call: 'loop', ...this.#draft(request, false) }, 'loop')
        this.wrong = ''
        // Values changed meanwhile are newer than this answer.
        const newer = this.#next as Request | null
        if (!newer || newer.drag) this.values = loop.values as Values
        this.changes = Object.keys(loop.values).length
        this.loop = { ...loop, verdict: this.loop?.verdict ?? null }
      } catch (error) {
        if (!(error instanceof Refused)) throw error
        this.wrong = error.message
      }
    }
    this.#busy = false
    this.#later()
  }

  #later() {
    this.predicted = false
    clearTimeout(this.#timer)
    this.#timer = window.setTimeout(() => void this.#check(), PAUSE)
  }

  /** After a pause of the input: corners, robustness, hunting, storage of the draft. */
  async #check() {
    if (this.#busy || this.wrong || !bench.connection.open) return
    const { values, desired } = this
    storeDraft(this.#key, values)
    const draft = this.#draft({ values }, true)
    const [loop, hunting, preview] = await Promise.allSettled([
      bench.connection.call({ call: 'loop', ...draft }, 'loop'),
      bench.connection.call({ call: 'hunting', draft, desired }, 'hunting'),
      bench.connection.call({ call: 'preview', values }, 'differences'),
    ])
    if (this.values !== values || this.desired !== desired || this.#busy) return
    if (preview.status === 'fulfilled') this.changes = preview.value.differences.length
    if (loop.status === 'fulfilled') {
      this.loop = loop.value
      this.checking = false
    } else if (loop.reason instanceof Refused) this.wrong = loop.reason.message
    this.huntingWrong = hunting.status === 'rejected' && hunting.reason instanceof Refused ? hunting.reason.message : ''
    if (hunting.status === 'fulfilled') this.hunting = hunting.value
    this.predicted = true
  }

  async #readTarget() {
    if (!bench.connection.open) return
    try {
      this.target = await bench.connection.call({ call: 'loop', speed: this.speed, values: {} }, 'loop')
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.target = null
    }
  }
}

const withoutController = (values: Values): Values => Object.fromEntries(Object.entries(values).filter(([path]) => !path.startsWith('bench.controller.')))

function storedDraft(key: string): Values {
  try {
    return JSON.parse(stored(key, '{}')) as Values
  } catch {
    return {}
  }
}

const storeDraft = (key: string, values: Values) => store(key, JSON.stringify(values))

export const controller = new ControllerState()
