// The connection to the bench: numbered calls, answers in any order, automatic reconnection.

import type { Answer, Call, Point } from './protocol'

type Waiting = { resolve: (answer: Answer) => void; reject: (error: Error) => void }
type Kind = Answer['answer']

/** A call that the bench refused, with the reason, or a missing connection. */
export class Refused extends Error {}

export class Connection {
  /** Called when the connection opens or closes. */
  onchange: (online: boolean) => void = () => {}
  /** Called with the points of the streams started on this connection. */
  onpoints: (stream: number, points: Point[]) => void = () => {}
  /** Called with the binary messages of sample streams. */
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
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => (typeof event.data === 'string' ? this.#receive(event.data) : this.onsamples(event.data))
    socket.onclose = () => {
      for (const one of this.#waiting.values()) one.reject(new Refused('The bench is not connected.'))
      this.#waiting.clear()
      if (this.#socket !== socket) return
      this.onchange(false)
      setTimeout(() => this.connect(), this.#pause)
      this.#pause = Math.min(this.#pause * 2, 3000)
    }
  }

  /** Opens a new connection, for example under another name. */
  reconnect() {
    const old = this.#socket
    this.connect()
    old?.close()
  }

  /** Sends a request or a command. */
  call<K extends Kind>(call: Call, kind: K): Promise<Extract<Answer, { answer: K }>> {
    if (!this.open) return Promise.reject(new Refused('The bench is not connected.'))
    const id = ++this.#number
    return new Promise((resolve, reject) => {
      const take = (answer: Answer) => {
        if (answer.answer === kind) resolve(answer as Extract<Answer, { answer: K }>)
        else reject(new Refused(`The answer ${answer.answer} belongs to another version of stickslip. Reload the page.`))
      }
      this.#waiting.set(id, { resolve: take, reject })
      this.#socket!.send(JSON.stringify({ id, ...call }))
    })
  }

  #receive(text: string) {
    const message = JSON.parse(text) as { id?: number; error?: string; stream?: number; points?: Point[] } & Partial<Answer>
    if (message.stream !== undefined && message.points) return this.onpoints(message.stream, message.points)
    const one = this.#waiting.get(message.id ?? -1)
    if (!one) return
    this.#waiting.delete(message.id ?? -1)
    if (message.error !== undefined) one.reject(new Refused(message.error))
    else one.resolve(message as Answer)
  }
}
