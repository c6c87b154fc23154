// The friction measurement: its plan, its course while it runs, its curve and fit behind.

import { bench, store, stored } from './bench.svelte'
import { Refused } from './connection'
import { plain } from './format'
import type { Changed, CurveName, MeasuredCurve, PlanForm, RenderedFriction, ToChatter } from './protocol'
import { curve, curves, rendered } from './runs'
import { view } from './view.svelte'

/** From look to look at a curve that grows [ms]. */
const LOOK = 400
/** The values of the plan that are offered at once. */
export const FIRST = ['slowest', 'fastest', 'speeds']

const COURSE = ['software.estimated_velocity', 'software.commanded_torque']

/** What the plot card shows. */
export type Tab = 'speed' | 'time' | 'shaped' | 'rendered' | 'load'
/** Runs that lie over the one that is shown, at most. */
export const MOST = 5

export type Offer = { run: number; values: Record<string, string>; changes: Changed[]; margin: ToChatter | null; refused: string | null }

/** The plan as it was chosen last, also before a reload. */
const kept: { thorough: boolean; values: Record<string, string> } = JSON.parse(
  stored('stickslip.friction', '{"thorough":false,"values":{}}'),
)

class Measurement {
  curve = $state.raw<MeasuredCurve | null>(null)
  names = $state.raw<CurveName[]>([])
  others = $state.raw<{ run: number; curve: MeasuredCurve }[]>([])
  thorough = $state(kept.thorough)
  values = $state.raw<Record<string, string>>(kept.values)
  plan = $state.raw<PlanForm | null>(null)
  wrong = $state('')
  offered = $state.raw<Offer | null>(null)
  /** The friction under the law that was measured last, or is. */
  rendered = $state.raw<RenderedFriction | null>(null)
  /** What is measured now is that. */
  rendering = $state(false)
  tab = $state<Tab>('speed')
  /** Number of the report that was saved last. */
  report = $state<number | null>(null)
  /** The course over time, past the framework: seconds, velocities, torques. Counts up when there is more. */
  time: { t: number[]; velocity: number[]; torque: number[] } = { t: [], velocity: [], torque: [] }
  ticks = $state(0)
  #begun = 0
  #stream = 0
  #asking = false
  #was = false

  /** Whether the own friction in force is the one fitted here. */
  downloaded = $derived.by(() => {
    const own = Object.entries(this.curve?.fit?.own ?? {})
    return own.length > 0 && own.every(([path, value]) => bench.item(path)?.value === Number(value))
  })

  constructor() {
    setInterval(() => void this.#look(), LOOK)
  }

  /** The plan with what was changed in it, and how long it takes. */
  async ask() {
    store('stickslip.friction', JSON.stringify({ thorough: this.thorough, values: this.values }))
    try {
      const call = { call: 'plan', what: 'friction', thorough: this.thorough, plan: this.values } as const
      this.plan = await bench.connection.call(call, 'plan')
      this.wrong = ''
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.wrong = error.message
    }
  }

  choose(thorough: boolean) {
    this.thorough = thorough
    this.values = {}
    void this.ask()
  }

  change(path: string, value: string) {
    this.values = { ...this.values, [path]: value }
    void this.ask()
  }

  async begin(render = false): Promise<boolean> {
    if (!this.plan) await this.ask()
    const values = Object.fromEntries(
      (this.plan?.items ?? []).filter((item) => item.value !== null && item.value !== item.default).map((item) => [item.path, plain(item.value!)]),
    )
    const ordered = await bench.order({ call: 'measure', what: 'friction', plan: values, render })
    if (ordered) this.rendering = render
    return ordered
  }

  /** Measures again while the load motor renders, and shows it. */
  async again() {
    if (bench.busy) return bench.warn(bench.busy)
    if (!(await this.begin(true))) return
    this.tab = 'rendered'
    view.go('/friction')
  }

  /** Writes the report and shows it in a tab of its own. */
  async save() {
    try {
      const { run } = await bench.connection.call({ call: 'save_report' }, 'report')
      this.report = run
      const open = () => void window.open(`/report/${run}`, '_blank', 'noopener')
      bench.say(`Report saved as run ${run}`, { name: 'Open', run: open })
      open()
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(error.message)
    }
  }

  /** What the download would change. */
  async offer() {
    const { curve } = this
    if (!curve?.fit || curve.run === null) return
    const values = curve.fit.own
    if (!Object.keys(values).length) return bench.warn('The data do not tell all four parameters: look at the notes for what would.')
    try {
      const [{ differences }, margin] = await Promise.all([
        bench.connection.call({ call: 'preview', values }, 'differences'),
        bench.connection.call({ call: 'margin', values }, 'margin').then(
          (margin): [ToChatter | null, string | null] => [margin, null],
          (error: Error): [ToChatter | null, string | null] => [null, error.message],
        ),
      ])
      this.offered = { run: curve.run, values, changes: differences, margin: margin[0], refused: margin[1] }
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(error.message)
    }
  }

  async download() {
    const offer = this.offered
    this.offered = null
    if (offer) await bench.enter(offer.values, `Own friction of run ${offer.run}`, { name: 'Next: Friction Design', run: () => view.go('/design') })
  }

  async compare(run: number) {
    if (this.others.some((other) => other.run === run)) this.others = this.others.filter((other) => other.run !== run)
    else {
      const found = await curve(run)
      if (found) this.others = [...this.others, { run, curve: found }].slice(-MOST)
    }
  }

  async #look() {
    if (this.#asking || !bench.fresh) return
    const runs = bench.measuring
    void this.#watch(runs)
    // While it runs, once behind it, and where nothing is known yet.
    if (!runs && !this.#was && this.curve && !this.curve.measuring) return
    this.#asking = true
    try {
      const found = await curve(null)
      this.rendering = found?.measuring === true && found.rendered
      if (this.rendering || (this.#was && !runs) || !this.rendered) this.rendered = await rendered()
      // The own friction stays while another one is measured.
      if (found && !this.rendering) this.curve = found
      if (!runs || !this.names.length) this.names = await curves()
      this.#was = runs
    } finally {
      this.#asking = false
    }
  }

  /** A stream of the course while something is measured. */
  async #watch(runs: boolean) {
    if (runs === this.#stream > 0) return
    const { connection } = bench
    if (!runs) {
      const capture = this.#stream
      this.#stream = 0
      return void bench.tried(connection.call({ call: 'drop', capture }, 'done'))
    }
    this.#stream = 1
    const call = { call: 'stream', signals: COURSE, every: 0.05 } as const
    const begun = await connection.call({ ...call, signals: [...COURSE] }, 'capture').catch(() => null)
    this.#stream = begun?.capture ?? 0
    this.time = { t: [], velocity: [], torque: [] }
    this.#begun = 0
    connection.onpoints = (stream, points) => {
      if (stream !== this.#stream) return
      const rate = bench.status?.rate ?? 1
      for (const point of points) {
        this.#begun ||= point.from
        this.time.t.push((point.to - this.#begun) / rate)
        this.time.velocity.push(point.last[0] ?? NaN)
        this.time.torque.push(point.last[1] ?? NaN)
      }
      this.ticks += 1
    }
  }
}

export const measurement = new Measurement()
