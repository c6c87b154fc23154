// The friction wheel preload recommended for the desired friction, and how to set it.

import { bench } from './bench.svelte'
import { Refused } from './connection'
import type { AdvisedPreload } from './protocol'

class Preload {
  advised = $state.raw<AdvisedPreload | null>(null)
  #key = ''

  /** Requests the recommendation after a change; `values` are those of a draft, by path. */
  async request(values: Record<string, string>, force: string) {
    const key = JSON.stringify([values, force])
    if (key === this.#key || !bench.online) return
    this.#key = key
    try {
      const advised = await bench.connection.call({ call: 'advise_preload', values }, 'advised_preload')
      if (key === this.#key) this.advised = advised
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      // No recommendation for a draft that the bench refuses.
      this.advised = null
    }
  }

  /** Sets the preload: by the bench, or confirmed after manual adjustment. */
  async set(preload: number) {
    if (await bench.command({ call: 'preload', preload })) bench.notify(`Friction wheel preload set to ${preload}`)
  }
}

export const preload = new Preload()
