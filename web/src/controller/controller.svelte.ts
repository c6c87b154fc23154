// The position controller that is being designed: what is not as on the target, what the program says to it, and the way
// back. One request is in flight, the newest draft wins; what takes longer comes when the hand rests.

import { bench, store, stored } from '../bench.svelte'
import { Refused } from '../connection'
import type { Offer } from '../measurement.svelte'
import type { DraftKind, HuntingView, Item, LoopDraft, LoopView, PoleDrag, TuneProgress } from '../protocol'
import { nearestStep, without, type Values } from './draft'

type Step = { values: Values; name: string; key: string }
type Ask = { values: Values; kind?: DraftKind; drag?: PoleDrag }
/** The load whose curves are shown. */
export type Load = 'both' | 'sliding' | 'stuck'

export const KIND = 'bench.controller.kind'
/** The hand rests after this time [ms]. */
const REST = 250
/** From look to look at a tuning [ms]. */
const LOOK = 200

class ControllerState {
  /** The draft: value by path where it is not as on the target. */
  values = $state.raw<Values>({})
  seen = $state.raw<LoopView | null>(null)
  /** The controller on the target. */
  target = $state.raw<LoopView | null>(null)
  /** What is shown is older than the draft. */
  checking = $state(true)
  wrong = $state('')
  hunting = $state.raw<HuntingView | null>(null)
  /** The prediction is that of the draft. */
  predicted = $state(false)
  huntingWrong = $state('')
  /** Whether it is asked about the friction that the load motor renders. */
  desired = $state(false)
  /** Speed at which the load slides [rad/s]. */
  speed = $state(10)
  load = $state<Load>('both')
  /** The frequency under the pointer [Hz]. */
  cursor = $state<number | null>(null)
  tune = $state.raw<TuneProgress | null>(null)
  past = $state.raw<Step[]>([])
  future = $state.raw<Step[]>([])
  offered = $state.raw<Omit<Offer, 'run'> | null>(null)
  #flying = false
  #next: Ask | null = null
  #rest = 0
  #last = 0
  #key = ''

  changes = $derived(Object.keys(this.values).length)
  tuning = $derived(this.tune !== null && !this.tune.ended)
  /** Why the draft cannot be changed; null where it can. */
  held = $derived.by((): string | null => {
    if (!bench.fresh) return bench.barred
    return this.tuning ? 'Automatic is at work' : null
  })
  /** Why it cannot be downloaded; null where it can. */
  off = $derived.by((): string | null => {
    if (bench.busy) return bench.busy
    if (this.tuning) return 'Automatic is at work'
    if (this.wrong) return this.wrong
    return this.changes ? null : 'This controller is on the target'
  })

  item(name: string): Item | undefined {
    return this.seen?.items.find((item) => item.path === name)
  }

  /** Takes up the draft of this project, and looks at what is on the target. */
  begin() {
    const key = `stickslip.controller.${location.host}.${bench.status?.preset ?? ''}`
    if (bench.status && key !== this.#key) {
      this.#key = key
      this.values = kept(key)
    }
    void this.#look()
    this.#ask({ values: this.values })
  }

  change(path: string, value: string, name: string) {
    this.note(name, path)
    this.set(without(this.values, path, value))
  }

  set(values: Values) {
    this.values = values
    this.#ask({ values })
  }

  choose(kind: string) {
    this.note(`Controller ${kind}`)
    if (kind === bench.item(KIND)?.choice) this.set(withoutController(this.values))
    else this.#ask({ values: this.values, kind: kind as DraftKind })
  }

  /** A hand on the wanted poles; `from` is the draft when it began. */
  drag(from: Values, drag: PoleDrag) {
    this.#ask({ values: from, drag })
  }

  slides(speed: number) {
    this.speed = speed
    void this.#look()
    this.#ask({ values: this.values })
  }

  ofDesired(desired: boolean) {
    this.desired = desired
    this.#later()
  }

  /** A step that can be undone begins. */
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
    if (!step || this.held) return
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

  /** Tunes the draft; the bench goes on. */
  async automatic() {
    const values = this.values
    try {
      const begun = await bench.connection.call({ call: 'tune', values, speed: this.speed }, 'tuned')
      this.tune = begun
      while (this.tune && !this.tune.ended) {
        await new Promise((resolve) => setTimeout(resolve, LOOK))
        const now = await bench.connection.call({ call: 'tuned' }, 'tuned')
        if (now.number !== begun.number) break
        this.tune = now
      }
      if (this.tune?.ended && this.tune.values) {
        const told = this.tune
        this.note('Automatic')
        this.tune = told
        this.set(told.values as Values)
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.tune = null
      bench.warn(error.message)
    }
  }

  async cancel() {
    await bench.order({ call: 'end_tuning' })
  }

  /** What the download would change. */
  async offer() {
    const { values, off } = this
    if (off) return bench.warn(off)
    try {
      const { differences } = await bench.connection.call({ call: 'preview', values }, 'differences')
      const verdict = this.checking ? null : this.seen?.verdict
      this.offered = { values, changes: differences, margin: null, refused: verdict && !verdict.fair ? verdict.sentences.join(' ') : null }
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(error.message)
    }
  }

  async download() {
    const values = this.offered?.values
    this.offered = null
    if (values && (await bench.enter(values, 'Controller'))) this.set({})
  }

  #ask(ask: Ask) {
    this.#next = ask
    this.checking = true
    this.predicted = false
    if (!this.#flying) void this.#fly()
  }

  #draft(ask: Ask, thorough: boolean): LoopDraft {
    return { values: ask.values, kind: ask.kind ?? null, drag: ask.drag ?? null, speed: this.speed, thorough }
  }

  async #fly() {
    this.#flying = true
    clearTimeout(this.#rest)
    while (this.#next && bench.connection.open) {
      const ask = this.#next
      this.#next = null
      try {
        const seen = await bench.connection.call({ call: 'loop', ...this.#draft(ask, false) }, 'loop')
        this.wrong = ''
        // What was changed meanwhile is newer than this answer.
        const newer = this.#next as Ask | null
        if (!newer || newer.drag) this.values = seen.values as Values
        this.seen = { ...seen, verdict: this.seen?.verdict ?? null }
      } catch (error) {
        if (!(error instanceof Refused)) throw error
        this.wrong = error.message
      }
    }
    this.#flying = false
    this.#later()
  }

  #later() {
    this.predicted = false
    clearTimeout(this.#rest)
    this.#rest = window.setTimeout(() => void this.#rested(), REST)
  }

  /** The hand rests: corners, verdict, hunting, the draft kept. */
  async #rested() {
    if (this.#flying || this.wrong || !bench.connection.open) return
    const { values, desired } = this
    keep(this.#key, values)
    const draft = this.#draft({ values }, true)
    const [seen, hunting] = await Promise.allSettled([
      bench.connection.call({ call: 'loop', ...draft }, 'loop'),
      bench.connection.call({ call: 'hunting', draft, desired }, 'hunting'),
    ])
    if (this.values !== values || this.desired !== desired || this.#flying) return
    if (seen.status === 'fulfilled') {
      this.seen = seen.value
      this.checking = false
    } else if (seen.reason instanceof Refused) this.wrong = seen.reason.message
    this.huntingWrong = hunting.status === 'rejected' && hunting.reason instanceof Refused ? hunting.reason.message : ''
    if (hunting.status === 'fulfilled') this.hunting = hunting.value
    this.predicted = true
  }

  async #look() {
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

function kept(key: string): Values {
  try {
    return JSON.parse(stored(key, '{}')) as Values
  } catch {
    return {}
  }
}

const keep = (key: string, values: Values) => store(key, JSON.stringify(values))

export const controller = new ControllerState()
