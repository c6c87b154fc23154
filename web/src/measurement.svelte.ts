// Friction measurements: plans, running measurement, results.

import { bench, store, stored } from './bench.svelte'
import { Refused } from './connection'
import { plain } from './format'
import type { BreakawayMeasurement, Changed, ChatterMargin, CurveName, MeasuredCurve, NearestLimit, PlanForm, Quantity, RenderedFriction } from './protocol'
import { atRest, curve, curves, rendered } from './runs'
import { view } from './view.svelte'

/** Interval between two requests of a growing curve [ms]. */
const POLL_INTERVAL = 400
/** The values of a plan displayed by default. */
export const DEFAULT_FIELDS: Record<Quantity, string[]> = {
  friction: ['slowest', 'fastest', 'speeds'],
  breakaway: ['rate', 'rest_time', 'angles', 'repetitions'],
  presliding: ['share', 'slow_frequency', 'quick_frequency'],
}

const COURSE = ['software.estimated_velocity', 'software.commanded_torque']

/** The tabs of the plot card. */
export type Tab = 'speed' | 'time' | 'breakaway' | 'presliding' | 'shaped' | 'rendered' | 'load'
/** Maximum number of compared runs. */
export const MOST = 5

export type Offer = { run: number; values: Record<string, string>; changes: Changed[]; margin: ChatterMargin | null; refused: string | null; nearest?: NearestLimit | null }

/** The selected plans, stored across reloads. */
type Chosen = { thorough: boolean; values: Record<string, string> }
const NOTHING: Chosen = { thorough: false, values: {} }
const chosen = (what: Quantity): Chosen => JSON.parse(stored(`stickslip.${what}`, JSON.stringify(NOTHING)))

class Measurement {
  curve = $state.raw<MeasuredCurve | null>(null)
  names = $state.raw<CurveName[]>([])
  others = $state.raw<{ run: number; curve: MeasuredCurve }[]>([])
  #chosen = $state.raw<Record<Quantity, Chosen>>({ friction: chosen('friction'), breakaway: chosen('breakaway'), presliding: chosen('presliding') })
  #plans = $state.raw<Partial<Record<Quantity, PlanForm>>>({})
  /** Results at rest, complete or growing. */
  results = $state.raw<Partial<Record<Quantity, BreakawayMeasurement>>>({})
  wrong = $state('')
  offered = $state.raw<Offer | null>(null)
  /** The newest curve with rendered friction, complete or growing. */
  rendered = $state.raw<RenderedFriction | null>(null)
  /** True while a curve with rendered friction is measured. */
  rendering = $state(false)
  tab = $state<Tab>('speed')
  /** The quantity of the active tab. */
  what = $derived<Quantity>(this.tab === 'breakaway' || this.tab === 'presliding' ? this.tab : 'friction')
  thorough = $derived(this.#chosen[this.what].thorough)
  values = $derived(this.#chosen[this.what].values)
  plan = $derived(this.#plans[this.what] ?? null)
  /** The running measurement. */
  running = $derived((bench.measuring ? (bench.status?.doing?.what.split(' ')[1] ?? null) : null) as Quantity | null)
  /** Number of the last saved report. */
  report = $state<number | null>(null)
  /** Samples of the running measurement, not reactive: seconds, velocities, torques. `ticks` increases with each update. */
  time: { t: number[]; velocity: number[]; torque: number[] } = { t: [], velocity: [], torque: [] }
  ticks = $state(0)
  #origin = 0
  #stream = 0
  #polling = false
  #previous: Quantity | null = null

  /** True if the own friction on the target is the fitted one. */
  downloaded = $derived.by(() => {
    const own = Object.entries(this.curve?.fit?.own ?? {})
    return own.length > 0 && own.every(([path, value]) => bench.item(path)?.value === Number(value))
  })

  constructor() {
    setInterval(() => void this.#poll(), POLL_INTERVAL)
  }

  /** Requests the plan with the changed values, and its duration. */
  async requestPlan(what: Quantity = this.what) {
    const { thorough, values } = this.#chosen[what]
    store(`stickslip.${what}`, JSON.stringify({ thorough, values }))
    try {
      const plan = await bench.connection.call({ call: 'plan', what, thorough, plan: values }, 'plan')
      this.#plans = { ...this.#plans, [what]: plan }
      this.wrong = ''
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.wrong = error.message
    }
  }

  choose(thorough: boolean) {
    this.#choose({ thorough, values: {} })
  }

  change(path: string, value: string) {
    this.#choose({ ...this.#chosen[this.what], values: { ...this.values, [path]: value } })
  }

  #choose(chosen: Chosen) {
    this.#chosen = { ...this.#chosen, [this.what]: chosen }
    void this.requestPlan()
  }

  /** Selects a tab and loads its newest result. */
  show(tab: Tab) {
    this.tab = tab
    this.wrong = ''
    void this.requestPlan()
    if (this.what !== 'friction' && !this.results[this.what]) void this.load()
  }

  /** Loads the result of a run at rest, by default the newest. */
  async load(run: number | null = null, what: Quantity = this.what) {
    const result = what === 'friction' ? null : await atRest(what, run)
    if (result) this.results = { ...this.results, [what]: result }
  }

  async start(render = false): Promise<boolean> {
    const what = render ? 'friction' : this.what
    if (!this.#plans[what]) await this.requestPlan(what)
    const values = Object.fromEntries(
      (this.#plans[what]?.items ?? []).filter((item) => item.value !== null && item.value !== item.default).map((item) => [item.path, plain(item.value!)]),
    )
    const ordered = await bench.command({ call: 'measure', what, plan: values, render })
    if (ordered) this.rendering = render
    return ordered
  }

  /** Measures again with the load motor rendering, and shows the result. */
  async measureRendered() {
    if (bench.busy) return bench.warn(bench.busy)
    if (!(await this.start(true))) return
    this.tab = 'rendered'
    view.go('/friction')
  }

  /** Writes the report and opens it in a new tab. */
  async save() {
    try {
      const { run } = await bench.connection.call({ call: 'save_report' }, 'report')
      this.report = run
      const open = () => void window.open(`/report/${run}`, '_blank', 'noopener')
      bench.notify(`Report saved as run ${run}`, { name: 'Open', run: open })
      open()
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(error.message)
    }
  }

  /** Shows the changes of a download. */
  async offer() {
    const of = this.what === 'friction' ? { run: this.curve?.run, own: this.curve?.fit?.own } : (this.results[this.what] ?? {})
    const { run, own: values } = of
    if (run == null || !values) return
    if (!Object.keys(values).length) return bench.warn('The data do not determine all four parameters. See the notes for the measurement required.')
    try {
      const [{ differences }, margin] = await Promise.all([
        bench.connection.call({ call: 'preview', values }, 'differences'),
        bench.connection.call({ call: 'margin', values }, 'margin').then(
          (margin): [ChatterMargin | null, string | null] => [margin, null],
          (error: Error): [ChatterMargin | null, string | null] => [null, error.message],
        ),
      ])
      this.offered = { run, values, changes: differences, margin: margin[0], refused: margin[1] }
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      bench.warn(error.message)
    }
  }

  async download() {
    const offer = this.offered
    if (offer) await bench.apply(offer.values, `Own friction of run ${offer.run}`, { name: 'Next: Friction Design', run: () => view.go('/design') })
    this.offered = null
  }

  async compare(run: number) {
    if (this.others.some((other) => other.run === run)) this.others = this.others.filter((other) => other.run !== run)
    else {
      const loaded = await curve(run)
      if (loaded) this.others = [...this.others, { run, curve: loaded }].slice(-MOST)
    }
  }

  async #poll() {
    if (this.#polling || !bench.fresh) return
    const { running } = this
    const runs = running !== null
    void this.#watch(runs)
    const rest = [running, this.#previous].find((what) => what === 'breakaway' || what === 'presliding')
    if (rest) {
      this.#polling = true
      await this.load(null, rest).finally(() => (this.#polling = false))
      this.#previous = this.results[rest]?.measuring ? rest : null
      return
    }
    // Requests the curve during a measurement, once after its end, and at the start.
    if (!runs && !this.#previous && this.curve && !this.curve.measuring) return
    this.#polling = true
    try {
      const newest = await curve(null)
      this.rendering = newest?.measuring === true && newest.rendered
      if (this.rendering || (this.#previous && !runs) || !this.rendered) this.rendered = await rendered()
      // The own curve is kept while a rendered curve is measured.
      if (newest && !this.rendering) this.curve = newest
      if (!runs || !this.names.length) this.names = await curves()
      this.#previous = running
    } finally {
      this.#polling = false
    }
  }

  /** Streams velocity and torque during a measurement. */
  async #watch(runs: boolean) {
    if (runs === this.#stream > 0) return
    const { connection } = bench
    if (!runs) {
      const capture = this.#stream
      this.#stream = 0
      return void bench.attempt(connection.call({ call: 'drop', capture }, 'done'))
    }
    this.#stream = 1
    const call = { call: 'stream', signals: COURSE, every: 0.05 } as const
    const capture = await connection.call({ ...call, signals: [...COURSE] }, 'capture').catch(() => null)
    this.#stream = capture?.capture ?? 0
    this.time = { t: [], velocity: [], torque: [] }
    this.#origin = 0
    connection.onpoints = (stream, points) => {
      if (stream !== this.#stream) return
      const rate = bench.status?.rate ?? 1
      for (const point of points) {
        this.#origin ||= point.from
        this.time.t.push((point.to - this.#origin) / rate)
        this.time.velocity.push(point.last[0] ?? NaN)
        this.time.torque.push(point.last[1] ?? NaN)
      }
      this.ticks += 1
    }
  }
}

export const measurement = new Measurement()
