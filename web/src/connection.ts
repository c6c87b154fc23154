// One conversation with the bench: calls with numbers, answers in any order, reconnection by itself.

import type { Answer, Call, Point } from './protocol'

type Waiting = { resolve: (answer: Answer) => void; reject: (error: Error) => void }
type Kind = Answer['answer']

/** What the bench refused, in its own words, or that it cannot be reached. */
export class Refused extends Error {}

export class Connection {
  /** Hears whether there is a connection. */
  onchange: (online: boolean) => void = () => {}
  /** Hears the points of the streams that were begun here. */
  onpoints: (stream: number, points: Point[]) => void = () => {}
  /** Hears every cycle of the streams that want it, as bytes. */
  onsamples: (buffer: ArrayBuffer) => void = () => {}
  #name: () => string
  #socket: WebSocket | null = null
  #waiting = new Map<number, Waiting>()
  #number = 0
  #pause = 250

  constructor(name: () => string) {
    this.#name = name
  }

  get open(): boolean {
    return this.#socket?.readyState === WebSocket.OPEN
  }

  connect() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws'
    const socket = new WebSocket(`${scheme}://${location.host}/api/live?client=${encodeURIComponent(this.#name())}`)
    socket.binaryType = 'arraybuffer'
    this.#socket = socket
    socket.onopen = () => {
      this.#pause = 250
      this.onchange(true)
    }
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => (typeof event.data === 'string' ? this.#hear(event.data) : this.onsamples(event.data))
    socket.onclose = () => {
      for (const one of this.#waiting.values()) one.reject(new Refused('The bench is not connected.'))
      this.#waiting.clear()
      if (this.#socket !== socket) return
      this.onchange(false)
      setTimeout(() => this.connect(), this.#pause)
      this.#pause = Math.min(this.#pause * 2, 3000)
    }
  }

  /** Begins anew, under another name. */
  again() {
    const old = this.#socket
    this.connect()
    old?.close()
  }

  /** Asks or orders something. */
  call<K extends Kind>(call: Call, kind: K): Promise<Extract<Answer, { answer: K }>> {
    if (!this.open) return Promise.reject(new Refused('The bench is not connected.'))
    const id = ++this.#number
    return new Promise((resolve, reject) => {
      const take = (answer: Answer) => {
        if (answer.answer === kind) resolve(answer as Extract<Answer, { answer: K }>)
        else reject(new Refused(`An answer of another version of stickslip: ${answer.answer}. Reload the page.`))
      }
      this.#waiting.set(id, { resolve: take, reject })
      this.#socket!.send(JSON.stringify({ id, ...call }))
    })
  }

  #hear(text: string) {
    const message = JSON.parse(text) as { id?: number; error?: string; stream?: number; points?: Point[] } & Partial<Answer>
    if (message.stream !== undefined && message.points) return this.onpoints(message.stream, message.points)
    const one = this.#waiting.get(message.id ?? -1)
    if (!one) return
    this.#waiting.delete(message.id ?? -1)
    if (message.error !== undefined) one.reject(new Refused(message.error))
    else one.resolve(message as Answer)
  }
}
