// Captures: samples saved as runs of the project, and files of samples for other programs.

import { bench } from '../bench.svelte'
import { Refused } from '../connection'
import { save as download } from '../plot/export'
import type { Run } from '../protocol'
import { packed, ringOf, unpacked } from './samples'
import { scope } from './scope.svelte'

/** Files that the program writes from samples. */
export const KINDS = { mf4: 'MDF 4', parquet: 'Parquet', mat: 'MAT' } as const
export type Kind = keyof typeof KINDS
/** Captures in the list. */
const MOST = 50

class Captures {
  list = $state.raw<Run[]>([])

  async load() {
    try {
      this.list = (await bench.connection.call({ call: 'runs', query: 'kind:capture', limit: MOST }, 'runs')).runs.filter((run) => run.kind === 'capture')
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    }
  }

  /** Saves every cycle of all signals in a range. */
  async save(name: string, from: number, to: number, trigger: number | null) {
    const body = this.#body(scope.signals.map((signal) => signal.name), from, to, trigger)
    if (!body) return bench.warn('The range has no cycles in the memory of the page')
    const answer = await this.#post(`/scope/captures?name=${encodeURIComponent(name.slice(0, 80))}`, body)
    if (!answer) return
    const { run } = (await answer.json()) as { run: number }
    bench.notify(`Capture saved as run ${run}: ${name}`)
    void this.load()
  }

  /** Shows a capture in the scope. Returns whether it was read. */
  async open(run: number, name: string, view?: [number, number]): Promise<boolean> {
    const answer = await fetch(`/scope/captures/${run}`).catch(() => null)
    if (!answer?.ok) {
      bench.warn(answer ? (await answer.text()).trim() : 'The bench is not connected.')
      return false
    }
    const samples = unpacked(await answer.arrayBuffer())
    scope.showCapture({ run, name }, ringOf(samples, scope.streamed), samples.rate, samples.trigger)
    if (view) scope.show(...view)
    return true
  }

  /** Downloads the signals in the panes as a file that the program writes. */
  async leave(kind: Kind, [from, to]: [number, number]) {
    const names = [...new Set(scope.panes.flatMap((pane) => pane.traces.map((trace) => trace.name)))]
    const body = this.#body(names, from, to, scope.triggered)
    if (!body) return bench.warn('No data')
    const answer = await this.#post(`/scope/export/${kind}`, body)
    if (answer) download(`scope.${kind}`, 'application/octet-stream', await answer.blob())
  }

  #body(names: string[], from: number, to: number, trigger: number | null): Blob | null {
    const signals = names.map((name) => ({ index: scope.index(name), signal: scope.signals[scope.index(name)]! })).filter(({ index }) => index >= 0)
    return scope.ring && signals.length ? packed(scope.ring, signals, from, to, scope.rate, trigger) : null
  }

  async #post(address: string, body: Blob): Promise<Response | null> {
    const headers = { 'Content-Type': 'application/octet-stream' }
    const answer = await fetch(address, { method: 'POST', headers, body }).catch(() => null)
    if (answer?.ok) return answer
    const text = answer ? await answer.text() : 'The bench is not connected.'
    bench.warn(`Scope: ${text.startsWith('{') ? (JSON.parse(text) as { error: string }).error : text.trim()}`)
    return null
  }
}

export const captures = new Captures()
