// The measurements of friction: their plans, their course while they run, what they found behind.

import { bench, store, stored } from './bench.svelte'
import { Refused } from './connection'
import { plain } from './format'
import type { Changed, CurveName, BreakawayMeasurement, MeasuredCurve, PlanForm, Quantity, RenderedFriction, ChatterMargin } from './protocol'
import { atRest, curve, curves, rendered } from './runs'
import { view } from './view.svelte'

/** From look to look at a curve that grows [ms]. */
const LOOK = 400
/** The values of a plan that are offered at once. */
export const FIRST: Record<Quantity, string[]> = {
  friction: ['slowest', 'fastest', 'speeds'],
  breakaway: ['rate', 'rest_time', 'angles', 'repetitions'],
  presliding: ['share', 'slow_frequency', 'quick_frequency'],
}

const COURSE = ['software.estimated_velocity', 'software.commanded_torque']

/** What the plot card shows. */
export type Tab = 'speed' | 'time' | 'breakaway' | 'presliding' | 'shaped' | 'rendered' | 'load'
/** Runs that lie over the one that is shown, at most. */
export const MOST = 5

export type Offer = { run: number; values: Record<string, string>; changes: Changed[]; margin: ChatterMargin | null; refused: string | null }

/** Plans as they were chosen last, also before a reload. */
type Chosen = { thorough: boolean; values: Record<string, string> }
const NOTHING: Chosen = { thorough: false, values: {} }
const chosen = (what: Quantity): Chosen => JSON.parse(stored(`stickslip.${what}`, JSON.stringify(NOTHING)))

class Measurement {
  curve = $state.raw<MeasuredCurve | null>(null)
  names = $state.raw<CurveName[]>([])
  others = $state.raw<{ run: number; curve: MeasuredCurve }[]>([])
  #chosen = $state.raw<Record<Quantity, Chosen>>({ friction: chosen('friction'), breakaway: chosen('breakaway'), presliding: chosen('presliding') })
  #plans = $state.raw<Partial<Record<Quantity, PlanForm>>>({})
  /** What was found at rest, or is being. */
  found = $state.raw<Partial<Record<Quantity, BreakawayMeasurement>>>({})
  wrong = $state('')
  offered = $state.raw<Offer | null>(null)
  /** The friction under the law that was measured last, or is. */
  rendered = $state.raw<RenderedFriction | null>(null)
  /** What is measured now is that. */
  rendering = $state(false)
  tab = $state<Tab>('speed')
  /** What the plot card shows is found by this measurement. */
  what = $derived<Quantity>(this.tab === 'breakaway' || this.tab === 'presliding' ? this.tab : 'friction')
  thorough = $derived(this.#chosen[this.what].thorough)
  values = $derived(this.#chosen[this.what].values)
  plan = $derived(this.#plans[this.what] ?? null)
  /** What is measured now. */
  running = $derived((bench.measuring ? (bench.status?.doing?.what.split(' ')[1] ?? null) : null) as Quantity | null)
  /** Number of the report that was saved last. */
  report = $state<number | null>(null)
  /** The course over time, past the framework: seconds, velocities, torques. Counts up when there is more. */
  time: { t: number[]; velocity: number[]; torque: number[] } = { t: [], velocity: [], torque: [] }
  ticks = $state(0)
  #begun = 0
  #stream = 0
  #asking = false
  #was: Quantity | null = null

  /** Whether the own friction in force is the one fitted here. */
  downloaded = $derived.by(() => {
    const own = Object.entries(this.curve?.fit?.own ?? {})
    return own.length > 0 && own.every(([path, value]) => bench.item(path)?.value === Number(value))
  })

  constructor() {
    setInterval(() => void this.#look(), LOOK)
  }

  /** The plan with what was changed in it, and how long it takes. */
  async ask(what: Quantity = this.what) {
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
    void this.ask()
  }

  /** Shows a plot, with the newest that belongs to it. */
  show(tab: Tab) {
    this.tab = tab
    this.wrong = ''
    void this.ask()
    if (this.what !== 'friction' && !this.found[this.what]) void this.look()
  }

  /** What a run at rest found, or the newest. */
  async look(run: number | null = null, what: Quantity = this.what) {
    const found = what === 'friction' ? null : await atRest(what, run)
    if (found) this.found = { ...this.found, [what]: found }
  }

  async begin(render = false): Promise<boolean> {
    const what = render ? 'friction' : this.what
    if (!this.#plans[what]) await this.ask(what)
    const values = Object.fromEntries(
      (this.#plans[what]?.items ?? []).filter((item) => item.value !== null && item.value !== item.default).map((item) => [item.path, plain(item.value!)]),
    )
    const ordered = await bench.order({ call: 'measure', what, plan: values, render })
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
    const of = this.what === 'friction' ? { run: this.curve?.run, own: this.curve?.fit?.own } : (this.found[this.what] ?? {})
    const { run, own: values } = of
    if (run == null || !values) return
    if (!Object.keys(values).length) return bench.warn('The data do not tell all four parameters: look at the notes for what would.')
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
    const { running } = this
    const runs = running !== null
    void this.#watch(runs)
    const rest = [running, this.#was].find((what) => what === 'breakaway' || what === 'presliding')
    if (rest) {
      this.#asking = true
      await this.look(null, rest).finally(() => (this.#asking = false))
      this.#was = this.found[rest]?.measuring ? rest : null
      return
    }
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
      this.#was = running
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
