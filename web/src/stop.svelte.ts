// Stop has a connection of its own: nothing that the page does can be in its way.

import { bench } from './bench.svelte'
import { Connection } from './connection'

/** Without an answer for so long it is not confirmed [ms]. */
const PATIENCE = 200

class Stop {
  said = $state<'' | 'Stopping' | 'Confirmed' | 'Not confirmed, use the hardware stop' | 'Not connected'>('')
  #connection = new Connection(() => bench.name)
  #forget = 0

  begin() {
    this.#connection.connect()
  }

  press() {
    clearTimeout(this.#forget)
    this.said = 'Stopping'
    const late = setTimeout(() => (this.said = 'Not confirmed, use the hardware stop'), PATIENCE)
    const asked = this.#connection.open
      ? this.#connection.call({ call: 'stop' }, 'done')
      : fetch('/api', {
          method: 'POST',
          headers: { 'Content-Type': 'application/json', 'Stickslip-Client': encodeURIComponent(bench.name) },
          body: JSON.stringify({ call: 'stop' }),
        }).then((response) => {
          if (!response.ok) throw new Error(response.statusText)
        })
    asked.then(
      () => this.#done(late, 'Confirmed'),
      (error: Error) => {
        // Without torque there is nothing to stop, and the bench says so.
        const refused = this.#connection.open && bench.fresh && !bench.torque
        this.#done(late, refused ? 'Confirmed' : 'Not confirmed, use the hardware stop')
        if (refused) bench.warn(error.message)
      },
    )
  }

  #done(late: ReturnType<typeof setTimeout>, said: Stop['said']) {
    clearTimeout(late)
    this.said = said
    this.#forget = window.setTimeout(() => (this.said = ''), 4000)
  }
}

export const stop = new Stop()
