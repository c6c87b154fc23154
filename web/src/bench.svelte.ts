// The state of the bench on the page. Every displayed value comes from here.

import { Connection, Refused } from './connection'
import { age } from './format'
import type { Call, Changed, Item, Machine, Status } from './protocol'

/** Interval between two status requests [ms]. */
const POLL_INTERVAL = 100
/** Length of the message log. */
const LOG_LENGTH = 200
/** Age from which values are marked as old [ms]. */
const STALE = 1500

export type Action = { name: string; run: () => void }
/** A message: the action done, how to undo it and the next step. */
export type Message = { id: number; text: string; kind: 'done' | 'warning'; action?: Action; next?: Action }
export const THEMES = ['system', 'light', 'dark'] as const
type Theme = (typeof THEMES)[number]

export function stored(key: string, otherwise: string): string {
  try {
    return localStorage.getItem(key) ?? otherwise
  } catch {
    return otherwise
  }
}

export function store(key: string, value: string) {
  try {
    localStorage.setItem(key, value)
  } catch {
    // Without storage in the browser, the defaults apply.
  }
}

class Bench {
  status = $state.raw<Status | null>(null)
  machine = $state.raw<Machine | null>(null)
  items = $state.raw<Item[]>([])
  /** The parameters on the target that differ from those of the start. */
  differences = $state.raw<Changed[]>([])
  online = $state(false)
  /** Time of the last status and the current time [ms]. */
  received = $state(0)
  now = $state(Date.now())
  /** Number of downloads in progress. */
  applying = $state(0)
  messages = $state.raw<Message[]>([])
  /** The message log with times, including closed messages. */
  log = $state.raw<(Message & { at: Date })[]>([])
  name = $state(stored('stickslip.name', ''))
  theme = $state<Theme>(stored('stickslip.theme', 'system') as Theme)
  speed = $state(Number(stored('stickslip.speed', '0')))
  /** Whether single letters and digits are keys. */
  letters = $state(stored('stickslip.letters', 'true') === 'true')
  acknowledgedLost = $state(0)
  acknowledgedMissed = $state(0)
  connection: Connection
  #polling = false
  #message = 0
  #revision = ''

  /** True while values are current; otherwise the page shows their age. */
  fresh = $derived(this.online && this.now - this.received < STALE)
  state = $derived(this.fresh ? (this.status?.state ?? 'off') : 'offline')
  torque = $derived(['homing', 'running', 'stopping'].includes(this.state))
  homed = $derived(['ready', 'running'].includes(this.state))
  measuring = $derived(this.fresh && (this.status?.doing?.what.startsWith('measure') ?? false))
  /** The reason why commands to the bench are disabled; null if they are enabled. */
  blocked = $derived.by(() => {
    if (!this.fresh) return this.received ? `Not connected, values are ${age(this.now - this.received)} old` : 'Not connected'
    const other = this.status?.operator
    return other && other !== this.name ? `${other} has control` : null
  })
  /** As `blocked`, or the name of the running job. */
  busy = $derived(this.blocked ?? (this.status?.doing ? `${this.status.doing.what} is running` : null))
  speedUnit = $derived(this.machine?.speeds[this.speed] ?? { unit: 'rad/s', factor: 1 })
  dark = $derived.by(() => this.theme === 'dark' || (this.theme === 'system' && this.#systemDark))
  #systemDark = $state(matchMedia('(prefers-color-scheme: dark)').matches)

  constructor() {
    if (!this.name) this.rename(`Guest ${100 + Math.floor(Math.random() * 900)}`)
    this.connection = new Connection(() => this.name)
    this.connection.onchange = (online) => {
      this.online = online
      if (online) void this.refresh()
    }
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', (event) => (this.#systemDark = event.matches))
  }

  start() {
    this.connection.connect()
    setInterval(() => void this.#poll(), POLL_INTERVAL)
  }

  rename(name: string) {
    this.name = name.trim().slice(0, 40) || this.name
    store('stickslip.name', this.name)
    if (this.connection?.open) this.connection.reconnect()
  }

  nextTheme() {
    this.setTheme(THEMES[(THEMES.indexOf(this.theme) + 1) % THEMES.length]!)
    this.notify(`Theme: ${this.theme}`)
  }

  setTheme(theme: Theme) {
    this.theme = theme
    store('stickslip.theme', theme)
  }

  nextSpeed() {
    this.setSpeed((this.speed + 1) % (this.machine?.speeds.length ?? 1))
  }

  setSpeed(index: number) {
    this.speed = index
    store('stickslip.speed', String(index))
  }

  setLetters(on: boolean) {
    this.letters = on
    store('stickslip.letters', String(on))
  }

  /** Reads parameters and machine data again. */
  async refresh() {
    try {
      const [machine, items, { differences }] = await Promise.all([
        this.connection.call({ call: 'machine' }, 'machine'),
        this.connection.call({ call: 'items' }, 'items'),
        this.connection.call({ call: 'differences' }, 'differences'),
      ])
      this.machine = machine
      this.items = items.items
      this.differences = differences
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    }
  }

  item(path: string): Item | undefined {
    return this.items.find((item) => item.path === path)
  }

  /** Sends a command; a refusal becomes a message. */
  async command(call: Call): Promise<boolean> {
    return this.attempt(this.connection.call(call, 'done'))
  }

  /** Applies values to the target, with undo and an optional next step. */
  async apply(values: Record<string, string>, what: string, next?: Action): Promise<boolean> {
    const answer = this.connection.call({ call: 'set', values }, 'entered')
    this.applying += 1
    const applied = await this.attempt(answer).finally(() => (this.applying -= 1))
    if (!applied) return false
    void this.refresh()
    const cycle = (await answer).cycle
    this.notify(`${what} active on the target since cycle ${cycle}`, { name: 'Undo', run: () => void this.undo() }, next)
    return true
  }

  async undo() {
    if (await this.attempt(this.connection.call({ call: 'undo' }, 'entered'))) {
      void this.refresh()
      this.notify('Previous values restored')
    }
  }

  async attempt(promise: Promise<unknown>): Promise<boolean> {
    try {
      await promise
      return true
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.warn(error.message)
      return false
    }
  }

  notify(text: string, action?: Action, next?: Action) {
    this.#show({ id: 0, text, kind: 'done', action, next })
  }

  warn(text: string) {
    this.#show({ id: 0, text, kind: 'warning' })
  }

  dismiss(id: number) {
    this.messages = this.messages.filter((message) => message.id !== id)
  }

  #show(message: Message) {
    const id = ++this.#message
    this.messages = [...this.messages.slice(-2), { ...message, id }]
    this.log = [...this.log.slice(1 - LOG_LENGTH), { ...message, id, at: new Date() }]
    setTimeout(() => this.dismiss(id), message.kind === 'warning' || message.next ? 15_000 : 8_000)
  }

  async #poll() {
    this.now = Date.now()
    if (this.#polling || !this.online) return
    this.#polling = true
    try {
      const status = await this.connection.call({ call: 'status' }, 'status')
      // A restarted program counts its cycles from zero.
      const restarted = this.status && status.cycle < this.status.cycle
      const revision = [status.changed, status.undo, status.redo, status.preload].join()
      if (restarted || revision !== this.#revision) void this.refresh()
      this.#revision = revision
      // The reason why a job ended early becomes a message in every window.
      const ended = this.status?.doing && !status.doing ? status.last : null
      if (ended?.error) this.warn(`${ended.what}: ${ended.error}`)
      if (status.not_saved && status.not_saved !== this.status?.not_saved) this.warn(status.not_saved)
      this.status = status
      this.received = this.now = Date.now()
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    } finally {
      this.#polling = false
    }
  }
}

export const bench = new Bench()
