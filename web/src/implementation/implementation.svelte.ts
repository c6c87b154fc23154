// The implementation on the target: blocks, cycle times, granted real-time options, build of the code.

import { bench } from '../bench.svelte'
import { Refused } from '../connection'
import type { BuildProgress, DiagramPage, Flow, FlowBlock, Target, Timing } from '../protocol'
import { view } from '../view.svelte'

export const RUNS = ['compiling', 'testing']

class Implementation {
  flow = $state.raw<Flow | null>(null)
  timing = $state.raw<Timing | null>(null)
  target = $state.raw<Target | null>(null)
  built = $state.raw<BuildProgress | null>(null)
  /** Loaded pages of the diagram for the active values. */
  pages = $state.raw<Record<string, DiagramPage>>({})
  refused = $state('')
  selected = $state('')

  block = $derived<FlowBlock | null>(this.flow?.blocks.find((block) => block.id === this.selected) ?? null)
  building = $derived(RUNS.includes(this.built?.stage ?? ''))

  /** Reads blocks and pages again: another choice may be active. */
  async refresh() {
    await this.#attempt(async () => {
      this.flow = await bench.connection.call({ call: 'flow' }, 'flow')
      this.target ??= await bench.connection.call({ call: 'target' }, 'target')
      this.pages = {}
      this.refused = ''
    })
  }

  /** Reads the values that change continuously. */
  async watch() {
    await this.#attempt(async () => {
      const [timing, built] = await Promise.all([bench.connection.call({ call: 'timing' }, 'timing'), bench.connection.call({ call: 'built' }, 'built')])
      this.timing = timing
      this.built = built
    })
  }

  async page(page: string) {
    if (this.pages[page]) return
    await this.#attempt(async () => {
      const answer = await bench.connection.call({ call: 'diagram_page', page }, 'diagram_page')
      this.pages = { ...this.pages, [page]: answer }
    })
  }

  async build() {
    if (await bench.command({ call: 'build' })) await this.watch()
  }

  /** Opens a page inside the open pages. */
  open(page: string | null, within: string[] = []) {
    if (page) view.go(`/implementation?page=${[...within, page].join()}`)
  }

  async #attempt(work: () => Promise<void>) {
    try {
      await work()
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.refused = error.message
    }
  }
}

export const implementation = new Implementation()
