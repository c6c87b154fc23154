// Jog: the axis moves while a button or key is held. The call is repeated; the bench stops the axis if it stays away.

import { bench } from '../bench.svelte'
import { Refused } from '../connection'

/** Interval between two calls of a held button [ms]; the bench stops after 300 ms. */
const INTERVAL = 80
/** Unanswered calls after which no more are sent: late ones would arrive together. */
const WAITING = 3

export type Direction = 1 | -1

class Jog {
  /** The held direction; null: no button is held. */
  held = $state<Direction | null>(null)
  /** Jog speed [rad/s]. */
  speed = $state(10)
  /** True: the load motor renders the desired friction. */
  render = $state(false)
  #press = 0
  #pointer: number | null = null
  #timer = 0
  #waiting = 0

  /** Starts a jog; a second pointer ends the first one. */
  press(direction: Direction, pointer: number | null = null) {
    if (this.held !== null) return void (pointer !== this.#pointer && this.release())
    if (bench.blocked) return bench.warn(bench.blocked)
    this.held = direction
    this.#pointer = pointer
    // Another number for each press, also in another tab.
    this.#press = Math.floor(Math.random() * 2 ** 50)
    this.#waiting = 0
    void this.#call(direction * this.speed, true)
    this.#timer = window.setInterval(() => this.#waiting < WAITING && void this.#call(direction * this.speed), INTERVAL)
  }

  /** Ends the jog. */
  release() {
    if (this.held === null) return
    clearInterval(this.#timer)
    this.held = null
    this.#pointer = null
    if (bench.connection.open) void this.#call(0)
  }

  /** A pointer was pressed anywhere: a second one ends the jog. */
  otherPointer(pointer: number) {
    if (this.held !== null && pointer !== this.#pointer) this.release()
  }

  async #call(velocity: number, first = false) {
    const press = this.#press
    this.#waiting += 1
    try {
      await bench.connection.call({ call: 'jog', velocity, press, render: this.render }, 'done')
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      // A refusal after the release belongs to a call that was under way.
      if (press !== this.#press || this.held === null) return
      this.release()
      // The reason why a jog has ended is the message of its end.
      if (first) bench.warn(error.message)
    } finally {
      this.#waiting -= 1
    }
  }
}

export const jog = new Jog()
