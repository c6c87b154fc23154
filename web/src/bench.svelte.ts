// What the page knows of the bench. Everything that is shown comes from here.

import { Connection, Refused } from './connection'
import { age } from './format'
import type { Call, Item, Machine, Status } from './protocol'

/** From question to question [ms]. */
const LOOK = 100
/** So many messages can be read again. */
const TOLD = 200
/** Values that are older are not shown as if they were new [ms]. */
const STALE = 1500

export type Action = { name: string; run: () => void }
/** What was done, the way back, and what comes next. */
export type Message = { id: number; text: string; kind: 'done' | 'warning'; action?: Action; next?: Action }
type Theme = 'system' | 'light' | 'dark'

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
    // A browser that stores nothing asks again the next time.
  }
}

class Bench {
  status = $state.raw<Status | null>(null)
  machine = $state.raw<Machine | null>(null)
  items = $state.raw<Item[]>([])
  online = $state(false)
  /** When the newest values came, and the time now [ms]. */
  heard = $state(0)
  now = $state(Date.now())
  messages = $state.raw<Message[]>([])
  /** All that was said, also what has gone from sight, with its time. */
  told = $state.raw<(Message & { at: Date })[]>([])
  name = $state(stored('stickslip.name', ''))
  theme = $state<Theme>(stored('stickslip.theme', 'system') as Theme)
  speed = $state(Number(stored('stickslip.speed', '0')))
  seenLost = $state(0)
  seenHeld = $state(0)
  connection: Connection
  #asking = false
  #message = 0
  #revision = ''

  /** Values are shown as they are; otherwise with their age. */
  fresh = $derived(this.online && this.now - this.heard < STALE)
  state = $derived(this.fresh ? (this.status?.state ?? 'off') : 'offline')
  torque = $derived(['homing', 'running', 'stopping'].includes(this.state))
  homed = $derived(['ready', 'running'].includes(this.state))
  measuring = $derived(this.fresh && (this.status?.doing?.what.startsWith('measure') ?? false))
  /** Why controls that act on the bench are off; null where they are not. */
  barred = $derived.by(() => {
    if (!this.fresh) return this.heard ? `Not connected, values are ${age(this.now - this.heard)} old` : 'Not connected'
    const other = this.status?.operator
    return other && other !== this.name ? `${other} operates` : null
  })
  /** The same, and nothing else runs. */
  busy = $derived(this.barred ?? (this.status?.doing ? `${this.status.doing.what} runs` : null))
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

  begin() {
    this.connection.connect()
    setInterval(() => void this.#look(), LOOK)
  }

  rename(name: string) {
    this.name = name.trim().slice(0, 40) || this.name
    store('stickslip.name', this.name)
    if (this.connection?.open) this.connection.again()
  }

  nextTheme() {
    this.theme = this.theme === 'system' ? 'light' : this.theme === 'light' ? 'dark' : 'system'
    store('stickslip.theme', this.theme)
    this.say(`Theme: ${this.theme}`)
  }

  nextSpeed() {
    this.speed = (this.speed + 1) % (this.machine?.speeds.length ?? 1)
    store('stickslip.speed', String(this.speed))
  }

  /** Parameters and machine anew. */
  async refresh() {
    try {
      const [machine, items] = await Promise.all([
        this.connection.call({ call: 'machine' }, 'machine'),
        this.connection.call({ call: 'items' }, 'items'),
      ])
      this.machine = machine
      this.items = items.items
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    }
  }

  item(path: string): Item | undefined {
    return this.items.find((item) => item.path === path)
  }

  /** Orders something; what is refused is told. */
  async order(call: Call): Promise<boolean> {
    return this.tried(this.connection.call(call, 'done'))
  }

  /** Puts values in force, with a way back and perhaps a next step. */
  async enter(values: Record<string, string>, what: string, next?: Action): Promise<boolean> {
    const entered = this.connection.call({ call: 'set', values }, 'entered')
    if (!(await this.tried(entered))) return false
    void this.refresh()
    const cycle = (await entered).cycle
    this.say(`${what} in force since cycle ${cycle}`, { name: 'Undo', run: () => void this.undo() }, next)
    return true
  }

  async undo() {
    if (await this.tried(this.connection.call({ call: 'undo' }, 'entered'))) {
      void this.refresh()
      this.say('The values before are in force again')
    }
  }

  async tried(promise: Promise<unknown>): Promise<boolean> {
    try {
      await promise
      return true
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.warn(error.message)
      return false
    }
  }

  say(text: string, action?: Action, next?: Action) {
    this.#tell({ id: 0, text, kind: 'done', action, next })
  }

  warn(text: string) {
    this.#tell({ id: 0, text, kind: 'warning' })
  }

  dismiss(id: number) {
    this.messages = this.messages.filter((message) => message.id !== id)
  }

  #tell(message: Message) {
    const id = ++this.#message
    this.messages = [...this.messages.slice(-2), { ...message, id }]
    this.told = [...this.told.slice(1 - TOLD), { ...message, id, at: new Date() }]
    setTimeout(() => this.dismiss(id), message.kind === 'warning' || message.next ? 15_000 : 8_000)
  }

  async #look() {
    this.now = Date.now()
    if (this.#asking || !this.online) return
    this.#asking = true
    try {
      const status = await this.connection.call({ call: 'status' }, 'status')
      // A program that was started anew counts its cycles anew.
      const anew = this.status && status.cycle < this.status.cycle
      const revision = [status.changed, status.undo, status.redo, status.preload].join()
      if (anew || revision !== this.#revision) void this.refresh()
      this.#revision = revision
      // What ended by itself says why, wherever one looks.
      const ended = this.status?.doing && !status.doing ? status.last : null
      if (ended?.error) this.warn(`${ended.what}: ${ended.error}`)
      this.status = status
      this.heard = this.now = Date.now()
    } catch (error) {
      if (!(error instanceof Refused)) throw error
    } finally {
      this.#asking = false
    }
  }
}

export const bench = new Bench()
