// Stop has a separate connection, so that other requests cannot delay it.

import { bench } from './bench.svelte'
import { Connection } from './connection'

/** Timeout of the confirmation [ms]. */
const TIMEOUT = 200

class Stop {
  state = $state<'' | 'Stopping' | 'Confirmed' | 'Not confirmed, use the hardware stop' | 'Not connected'>('')
  #connection = new Connection(() => bench.name)
  #timer = 0

  start() {
    this.#connection.connect()
  }

  press() {
    clearTimeout(this.#timer)
    this.state = 'Stopping'
    const late = setTimeout(() => (this.state = 'Not confirmed, use the hardware stop'), TIMEOUT)
    const request = this.#connection.open
      ? this.#connection.call({ call: 'stop' }, 'done')
      : fetch('/api', {
          method: 'POST',
          headers: { 'Content-Type': 'application/json', 'Stickslip-Client': encodeURIComponent(bench.name) },
          body: JSON.stringify({ call: 'stop' }),
        }).then((response) => {
          if (!response.ok) throw new Error(response.statusText)
        })
    request.then(
      () => this.#done(late, 'Confirmed'),
      (error: Error) => {
        // With torque off, the bench refuses Stop; this counts as confirmed.
        const refused = this.#connection.open && bench.fresh && !bench.torque
        this.#done(late, refused ? 'Confirmed' : 'Not confirmed, use the hardware stop')
        if (refused) bench.warn(error.message)
      },
    )
  }

  #done(late: ReturnType<typeof setTimeout>, state: Stop['state']) {
    clearTimeout(late)
    this.state = state
    this.#timer = window.setTimeout(() => (this.state = ''), 4000)
  }
}

export const stop = new Stop()
