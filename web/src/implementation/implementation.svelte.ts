// What runs on the target: its blocks, its time in each cycle, what the system granted, and the build of its code.

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
  /** Pages of the diagram as they came, of what is in force now. */
  pages = $state.raw<Record<string, DiagramPage>>({})
  refused = $state('')
  selected = $state('')

  block = $derived<FlowBlock | null>(this.flow?.blocks.find((block) => block.id === this.selected) ?? null)
  building = $derived(RUNS.includes(this.built?.stage ?? ''))

  /** Blocks and pages anew: another choice may be in force. */
  async look() {
    await this.#asked(async () => {
      this.flow = await bench.connection.call({ call: 'flow' }, 'flow')
      this.target ??= await bench.connection.call({ call: 'target' }, 'target')
      this.pages = {}
      this.refused = ''
    })
  }

  /** What changes by itself. */
  async watch() {
    await this.#asked(async () => {
      const [timing, built] = await Promise.all([bench.connection.call({ call: 'timing' }, 'timing'), bench.connection.call({ call: 'built' }, 'built')])
      this.timing = timing
      this.built = built
    })
  }

  async page(page: string) {
    if (this.pages[page]) return
    await this.#asked(async () => {
      const found = await bench.connection.call({ call: 'diagram_page', page }, 'diagram_page')
      this.pages = { ...this.pages, [page]: found }
    })
  }

  async build() {
    if (await bench.order({ call: 'build' })) await this.watch()
  }

  /** A page inside those that are open. */
  open(page: string | null, within: string[] = []) {
    if (page) view.go(`/implementation?page=${[...within, page].join()}`)
  }

  async #asked(work: () => Promise<void>) {
    try {
      await work()
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.refused = error.message
    }
  }
}

export const implementation = new Implementation()
