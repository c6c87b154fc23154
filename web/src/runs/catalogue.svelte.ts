// The runs of the project: search, selection, comparison.

import { bench, store, stored } from '../bench.svelte'
import { Refused } from '../connection'
import type { Call, Records, RunEvent, ReplayProgress, Run, Value } from '../protocol'

/** Maximum number of compared runs. */
export const MOST = 6
/** Maximum number of rows. */
const PAGE = 200
/** Interval between two requests during a replay [ms]. */
const POLL_INTERVAL = 200

export type Details = { run: Run; values: Value[]; leaves_as: string[] }

class Catalogue {
  query = $state('')
  runs = $state.raw<Run[]>([])
  of = $state(0)
  hints = $state.raw<string[]>([])
  loaded = $state(false)
  /** Size and limit of the records of measurements. */
  records = $state.raw<Records | null>(null)
  /** Runs deleted since the window was opened stay in the list, with Undo. */
  deleted = $state.raw<Run[]>([])
  selected = $state.raw<Details | null>(null)
  story = $state.raw<RunEvent[] | null>(null)
  /** The reason if the events cannot be read. */
  storyError = $state('')
  replay = $state.raw<ReplayProgress | null>(null)
  /** Numbers of the runs to compare; the first one is the reference. */
  tray = $state.raw<number[]>(JSON.parse(stored('stickslip.tray', '[]')))
  compared = $state.raw<Details[]>([])

  rows = $derived.by(() => {
    const gone = this.deleted.filter((run) => !this.runs.some((one) => one.number === run.number))
    return [...this.runs, ...gone].sort((one, other) => other.number - one.number)
  })

  /** Runs the query. */
  async search() {
    const query = this.query
    const found = await orNull(bench.connection.call({ call: 'runs', query, limit: PAGE }, 'runs'))
    this.records = await orNull(bench.connection.call({ call: 'records' }, 'records'))
    // A newer request is running.
    if (!found || query !== this.query) return
    this.runs = found.runs
    this.of = found.of
    this.hints = found.hints
    this.loaded = true
    this.deleted = this.deleted.filter((run) => !found.runs.some((one) => one.number === run.number && one.state !== 'deleted'))
  }

  async select(number: number | null) {
    if (number === this.selected?.run.number) return
    this.story = this.replay = null
    this.storyError = ''
    if (number === null) return void (this.selected = null)
    const opened = await details(number)
    this.selected = opened
    if (!opened?.run.record || opened.run.state !== 'here') return
    try {
      const { happened } = await bench.connection.call({ call: 'story', number }, 'story')
      if (this.selected?.run.number === number) this.story = happened
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.storyError = error.message
    }
  }

  /** Replays the selected run and follows its progress. */
  async replaySelected() {
    const number = this.selected?.run.number
    if (number === undefined) return
    for (;;) {
      try {
        this.replay = await bench.connection.call({ call: 'replay', number }, 'replay')
      } catch (error) {
        if (!(error instanceof Refused)) throw error
        this.replay = null
        return bench.warn(error.message)
      }
      if (this.replay.ended || this.selected?.run.number !== number) return
      await new Promise((later) => setTimeout(later, POLL_INTERVAL))
    }
  }

  cancel() {
    void orNull(bench.connection.call({ call: 'end_replay' }, 'done'))
  }

  /** Changes name, tags or note of a run; returns whether it succeeded. */
  async edit(call: Extract<Call, { call: 'rename_run' | 'tag_run' | 'note_run' }>): Promise<boolean> {
    if (!(await bench.command(call))) return false
    const found = await details(call.number)
    if (found && this.selected?.run.number === call.number) this.selected = found
    void this.search()
    return true
  }

  async remove(run: Run) {
    if (!(await bench.command({ call: 'delete_run', number: run.number }))) return
    this.deleted = [...this.deleted, { ...run, state: 'deleted' }]
    bench.notify(`${run.name} stays in the bin for 30 days`, { name: 'Undo', run: () => void this.restore(run.number) })
    void this.search()
  }

  async restore(number: number) {
    if (!(await bench.command({ call: 'restore_run', number }))) return
    this.deleted = this.deleted.filter((run) => run.number !== number)
    await this.search()
  }

  inTray(number: number): boolean {
    return this.tray.includes(number)
  }

  compare(number: number) {
    if (this.inTray(number)) this.tray = this.tray.filter((one) => one !== number)
    else if (this.tray.length < MOST) this.tray = [...this.tray, number]
    else return bench.warn(`At most ${MOST} runs can be compared. Remove one first.`)
    store('stickslip.tray', JSON.stringify(this.tray))
  }

  clear() {
    this.tray = []
    store('stickslip.tray', '[]')
  }

  /** Loads the runs to compare, with parameters and results. */
  async loadTray() {
    const { tray } = this
    const found = await Promise.all(tray.map(details))
    if (tray !== this.tray) return
    this.compared = found.filter((one) => one !== null)
  }
}

async function details(number: number): Promise<Details | null> {
  return orNull(bench.connection.call({ call: 'run', number }, 'run'))
}

/** Returns null if the bench refuses or is not connected. */
async function orNull<T>(answer: Promise<T>): Promise<T | null> {
  try {
    return await answer
  } catch (error) {
    if (error instanceof Refused) return null
    throw error
  }
}

export const catalogue = new Catalogue()
