// Trials of the active controller, and comparisons of controllers.

import { bench } from '../bench.svelte'
import { Refused } from '../connection'
import type { Answer, Call, Comparison, TrialChoices, TrialPair, TrialRow, TrialSignal } from '../protocol'
import { jog } from './jog.svelte'

/** Number of listed trials. */
const LIMIT = 60
/** Number of time intervals, about one per pixel. */
const PARTS = 1200
/** Interval between two requests of a running comparison [ms]. */
const POLL_INTERVAL = 500
/** The value of the list for positions of a file. */
export const FILE = 'file'

class Trials {
  choices = $state.raw<TrialChoices | null>(null)
  rows = $state.raw<TrialRow[]>([])
  of = $state(0)
  loaded = $state(false)
  motion = $state('sine_2hz')
  file = $state.raw<{ name: string; text: string } | null>(null)
  repetitions = $state(1)
  /** The chosen trials. */
  a = $state<number | null>(null)
  b = $state<number | null>(null)
  signal = $state<TrialSignal>('deviation')
  repetition = $state(1)
  pair = $state.raw<TrialPair | null>(null)
  /** Why there is no picture. */
  refused = $state('')
  comparison = $state.raw<Comparison | null>(null)
  /** The controllers and manoeuvres to compare; the first controller is the reference. */
  controllers = $state.raw<string[]>(['active', 'state-feedback'])
  manoeuvres = $state.raw<string[]>(['sine_2hz'])
  compared = $state(3)
  #asking = 0

  constructor() {
    // The guided experiment shows in every window whether controllers were compared.
    $effect.root(() => {
      const ended = $derived(bench.online && (bench.status?.last?.what ?? ''))
      $effect(() => {
        if (bench.online && ended !== false) void this.refreshComparison()
      })
    })
  }

  /** The running task of this window. */
  running = $derived.by(() => {
    const doing = bench.fresh ? (bench.status?.doing ?? null) : null
    return doing && (doing.what.startsWith('test ') || doing.what === 'compare controllers') ? doing : null
  })
  comparing = $derived(this.running?.what === 'compare controllers')

  async refresh() {
    const choices = await this.#read({ call: 'trial_choices' }, 'trial_choices')
    if (choices) this.choices = choices
    const all = await this.#read({ call: 'trials', limit: LIMIT }, 'trials')
    const comparison = await this.#read({ call: 'comparison' }, 'comparison')
    if (comparison) this.comparison = comparison.run ? comparison : null
    if (!all) return
    const newest = all.trials[0]?.run ?? null
    // The newest trial is B, the one before A; a choice by hand stays.
    const before = this.rows[0]?.run ?? null
    this.rows = all.trials
    this.of = all.of
    this.loaded = true
    if (newest !== null && (this.a === null || newest !== before)) this.#follow()
    else void this.show()
  }

  /** Shows the newest trial as B, and the newest one of the same motion before it as A. */
  #follow() {
    const [newest, ...others] = this.rows
    const partner = others.find((row) => row.motion === newest!.motion)
    ;[this.a, this.b] = partner ? [partner.run, newest!.run] : [newest!.run, null]
    this.repetition = 1
    void this.show()
  }

  choose(which: 'a' | 'b', run: number) {
    if (which === 'a') this.a = run
    else this.b = this.b === run ? null : run
    if (which === 'a' && this.b === run) this.b = null
    this.repetition = 1
    void this.show()
  }

  /** Reads the curves of the chosen trials. */
  async show(range: [number, number] | null = null) {
    if (this.a === null) return
    const number = (this.#asking += 1)
    const { a, b, signal, repetition } = this
    try {
      const [from, to] = range ?? [null, null]
      const pair = await bench.connection.call({ call: 'trial_pair', a, b, signal, repetition, from, to, parts: PARTS }, 'trial_pair')
      if (number !== this.#asking) return
      this.pair = pair
      this.refused = ''
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      if (number === this.#asking) this.refused = error.message
    }
  }

  /** Starts a trial. */
  async run() {
    const file = this.motion === FILE ? this.file : null
    await bench.command({ call: 'trial', motion: this.motion, file, repetitions: this.repetitions, render: jog.render })
  }

  /** Starts a comparison. */
  async compare() {
    const { controllers, manoeuvres, compared } = this
    if (!(await bench.command({ call: 'compare', controllers, manoeuvres, repetitions: compared, render: jog.render }))) return
    this.comparison = null
    // The ranking appears as soon as it is computed.
    const poll = async () => {
      await this.refreshComparison()
      if (this.comparison?.running || this.comparing) setTimeout(() => void poll(), POLL_INTERVAL)
    }
    setTimeout(() => void poll(), POLL_INTERVAL)
  }

  async refreshComparison() {
    const comparison = await this.#read({ call: 'comparison' }, 'comparison')
    if (comparison) this.comparison = comparison.run ? comparison : null
  }

  async #read<K extends Answer['answer']>(call: Call, kind: K): Promise<Extract<Answer, { answer: K }> | null> {
    try {
      return await bench.connection.call(call, kind)
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      return null
    }
  }
}

export const trials = new Trials()

/** The numbers of the table as CSV. */
export function table(rows: TrialRow[]): string {
  const quoted = (text: string) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text)
  const heads = ['run', 'motion', 'controller', 'friction', 'repetitions', ...(rows[0]?.values ?? []).flatMap(({ title, unit }) => [`${title} [${unit}]`, `${title}, half of the 95 % interval [${unit}]`])]
  const lines = rows.map((row) => [row.run, row.motion, row.controller, row.friction, row.repetitions, ...row.values.flatMap(({ value, half_width }) => [value ?? '', half_width ?? ''])])
  return [heads, ...lines].map((line) => line.map((cell) => quoted(String(cell))).join(',')).join('\n') + '\n'
}
