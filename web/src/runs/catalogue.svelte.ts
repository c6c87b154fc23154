// The runs of the project: what was searched for, what is selected, what lies side by side.

import { bench, store, stored } from '../bench.svelte'
import { Refused } from '../connection'
import type { Call, RunEvent, ReplayProgress, Run, Value } from '../protocol'

/** Runs that can lie side by side. */
export const MOST = 6
/** Rows at once. */
const PAGE = 200
/** From look to look at a replay [ms]. */
const LOOK = 200

export type Details = { run: Run; values: Value[]; leaves_as: string[] }

class Catalogue {
  query = $state('')
  runs = $state.raw<Run[]>([])
  of = $state(0)
  hints = $state.raw<string[]>([])
  asked = $state(false)
  /** What was deleted since the window was opened stays in sight, with its Undo. */
  deleted = $state.raw<Run[]>([])
  selected = $state.raw<Details | null>(null)
  story = $state.raw<RunEvent[] | null>(null)
  /** Why there is none. */
  untold = $state('')
  replay = $state.raw<ReplayProgress | null>(null)
  /** Numbers of what lies side by side; the first is the base. */
  tray = $state.raw<number[]>(JSON.parse(stored('stickslip.tray', '[]')))
  compared = $state.raw<Details[]>([])

  rows = $derived.by(() => {
    const gone = this.deleted.filter((run) => !this.runs.some((one) => one.number === run.number))
    return [...this.runs, ...gone].sort((one, other) => other.number - one.number)
  })

  /** What the query finds. */
  async search() {
    const query = this.query
    const found = await quietly(bench.connection.call({ call: 'runs', query, limit: PAGE }, 'runs'))
    // A newer question is under way.
    if (!found || query !== this.query) return
    this.runs = found.runs
    this.of = found.of
    this.hints = found.hints
    this.asked = true
    this.deleted = this.deleted.filter((run) => !found.runs.some((one) => one.number === run.number && one.state !== 'deleted'))
  }

  async select(number: number | null) {
    if (number === this.selected?.run.number) return
    this.story = this.replay = null
    this.untold = ''
    if (number === null) return void (this.selected = null)
    const found = await details(number)
    this.selected = found
    if (!found?.run.record || found.run.state !== 'here') return
    try {
      const { happened } = await bench.connection.call({ call: 'story', number }, 'story')
      if (this.selected?.run.number === number) this.story = happened
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.untold = error.message
    }
  }

  /** Replays what is selected, and looks until it has ended. */
  async again() {
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
      await new Promise((later) => setTimeout(later, LOOK))
    }
  }

  cancel() {
    void quietly(bench.connection.call({ call: 'end_replay' }, 'done'))
  }

  /** Changes what a person may change of a run; whether it was taken. */
  async edit(call: Extract<Call, { call: 'rename_run' | 'tag_run' | 'note_run' }>): Promise<boolean> {
    if (!(await bench.order(call))) return false
    const found = await details(call.number)
    if (found && this.selected?.run.number === call.number) this.selected = found
    void this.search()
    return true
  }

  async remove(run: Run) {
    if (!(await bench.order({ call: 'delete_run', number: run.number }))) return
    this.deleted = [...this.deleted, { ...run, state: 'deleted' }]
    bench.say(`${run.name} lies in the bin for 30 days`, { name: 'Undo', run: () => void this.restore(run.number) })
    void this.search()
  }

  async restore(number: number) {
    if (!(await bench.order({ call: 'restore_run', number }))) return
    this.deleted = this.deleted.filter((run) => run.number !== number)
    await this.search()
  }

  inTray(number: number): boolean {
    return this.tray.includes(number)
  }

  compare(number: number) {
    if (this.inTray(number)) this.tray = this.tray.filter((one) => one !== number)
    else if (this.tray.length < MOST) this.tray = [...this.tray, number]
    else return bench.warn(`At most ${MOST} runs lie side by side: take one away first.`)
    store('stickslip.tray', JSON.stringify(this.tray))
  }

  clear() {
    this.tray = []
    store('stickslip.tray', '[]')
  }

  /** What lies side by side, with parameters and results. */
  async lay() {
    const wanted = this.tray
    const found = await Promise.all(wanted.map(details))
    if (wanted !== this.tray) return
    this.compared = found.filter((one) => one !== null)
  }
}

async function details(number: number): Promise<Details | null> {
  return quietly(bench.connection.call({ call: 'run', number }, 'run'))
}

/** What a bench that cannot be asked says by its silence. */
async function quietly<T>(asked: Promise<T>): Promise<T | null> {
  try {
    return await asked
  } catch (error) {
    if (error instanceof Refused) return null
    throw error
  }
}

export const catalogue = new Catalogue()
