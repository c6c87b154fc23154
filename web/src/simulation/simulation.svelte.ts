// Repeats a recorded run on the virtual bench with other parameters.

import { bench } from '../bench.svelte'
import { Refused } from '../connection'
import { plain } from '../format'
import type { Changed, Item, Run, Simulated, Value } from '../protocol'

export const PANES = [
  { title: 'Position', label: 'angle φ, rad', setpoint: 'setpoint.position', signals: ['angle'] },
  { title: 'Speed', label: 'speed Ω, rad/s', setpoint: 'setpoint.velocity', signals: ['software.estimated_velocity'] },
  { title: 'Torque', label: 'torque M, N·m', setpoint: null, signals: ['software.commanded_torque'] },
  { title: 'Load', label: 'torque M, N·m', setpoint: null, signals: ['software.measured_load_torque'] },
] as const
export const SIGNALS = PANES.flatMap(({ setpoint, signals }) => [...(setpoint ? [setpoint] : []), ...signals])
/** Number of time intervals, about one per pixel. */
const PARTS = 900
/** Parameters of the active controller that are offered first. */
const DEFAULT_FIELDS = ['position_gain', 'velocity_gain', 'proportional_gain', 'regulator.angle', 'regulator.bandwidth'].map(
  (name) => `bench.controller.${name}`,
)

class Simulation {
  runs = $state.raw<Run[]>([])
  run = $state.raw<Run | null>(null)
  /** Values of the run by path. */
  values = $state.raw<Map<string, Value>>(new Map())
  /** Offered paths, and changed values. */
  paths = $state.raw<string[]>(DEFAULT_FIELDS)
  changed = $state.raw<Record<string, string>>({})
  length = $state(60)
  result = $state.raw<Simulated | null>(null)
  differences = $state.raw<Changed[]>([])
  refused = $state('')
  working = $state(false)
  /** Duration of the last request [ms]. */
  duration = $state(0)
  /** Tolerances of the difference by signal; null: a hundredth of its recorded range. */
  tolerances = $state.raw<Record<string, number>>({})
  #newer = false

  /** The values of the simulation as fields. */
  items = $derived.by((): Item[] =>
    this.paths.flatMap((path) => {
      const item = bench.item(path)
      const own = this.values.get(path)?.number
      if (!item || own == null) return []
      return [{ ...item, value: path in this.changed ? Number(this.changed[path]) : own, default: own }]
    }),
  )

  async find() {
    try {
      const { runs } = await bench.connection.call({ call: 'runs', query: '', limit: 500 }, 'runs')
      this.runs = runs.filter((run) => run.record && run.state === 'here')
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    }
  }

  async choose(number: number | null) {
    const run = this.runs.find((one) => one.number === number) ?? this.runs[0] ?? null
    if (run?.number === this.run?.number) return
    this.run = run
    this.result = null
    this.tolerances = {}
    this.refused = ''
    this.changed = {}
    if (!run) return
    try {
      const { values } = await bench.connection.call({ call: 'run', number: run.number }, 'run')
      this.values = new Map(values.map((value) => [value.path, value]))
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    }
    void this.simulate()
  }

  offer(path: string) {
    if (!this.paths.includes(path)) this.paths = [...this.paths, path]
  }

  withdraw(path: string) {
    this.paths = this.paths.filter((one) => one !== path)
    this.set(path, null)
  }

  set(path: string, value: string | null) {
    const rest = Object.fromEntries(Object.entries(this.changed).filter(([one]) => one !== path))
    const own = this.values.get(path)?.number
    this.changed = value === null || Number(value) === own ? rest : { ...rest, [path]: plain(Number(value)) }
    void this.simulate()
  }

  /** One request at a time; a change in the meantime is sent after it. */
  async simulate() {
    if (!this.run) return
    if (this.working) return void (this.#newer = true)
    this.working = true
    do {
      this.#newer = false
      const start = performance.now()
      const number = this.run.number
      try {
        const call = { call: 'simulate', number, values: this.changed, signals: SIGNALS, length: this.length, parts: PARTS } as const
        const { simulated, differences } = await bench.connection.call({ ...call, signals: [...SIGNALS] }, 'simulated')
        if (this.run.number === number) {
          this.result = simulated
          this.differences = differences
          this.refused = ''
          this.duration = performance.now() - start
        }
      } catch (error) {
        if (!(error instanceof Refused)) throw error
        this.refused = error.message
      }
    } while (this.#newer)
    this.working = false
  }
}

export const simulation = new Simulation()
