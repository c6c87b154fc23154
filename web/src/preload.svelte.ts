// Which preload of the friction wheel the desired friction needs: the program's word, and the way to set it.

import { bench } from './bench.svelte'
import { Refused } from './connection'
import type { AdvisedPreload } from './protocol'

class Preload {
  advised = $state.raw<AdvisedPreload | null>(null)
  #asked = ''

  /** Asks where something became another: `values` are those of a draft, by path. */
  async ask(values: Record<string, string>, force: string) {
    const key = JSON.stringify([values, force])
    if (key === this.#asked || !bench.online) return
    this.#asked = key
    try {
      const advised = await bench.connection.call({ call: 'advise_preload', values }, 'advised_preload')
      if (key === this.#asked) this.advised = advised
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      // A draft that the bench would refuse has no advice.
      this.advised = null
    }
  }

  /** The linings are pressed on so far: by the bench, or by whoever says so. */
  async set(preload: number) {
    if (await bench.order({ call: 'preload', preload })) bench.say(`Linings pressed on to ${preload}`)
  }
}

export const preload = new Preload()
