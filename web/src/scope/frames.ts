// Every cycle of the signals: binary messages, read in place.

/** Size of the header [bytes]. */
const HEAD = 32

export type Frame = {
  stream: number
  /** First cycle. */
  from: number
  /** Missing cycles before it. */
  missing: number
  rows: number
  /** Values, one column per signal. */
  values: Float64Array
}

export function frame(buffer: ArrayBuffer): Frame {
  const head = new DataView(buffer, 0, HEAD)
  // Exact for three million years at 100 kHz.
  const word = (at: number) => Number(head.getBigUint64(at, true))
  const [rows, signals] = [head.getUint32(24, true), head.getUint32(28, true)]
  // Little-endian, as on every machine with a browser.
  const values = new Float64Array(buffer, HEAD, rows * signals)
  return { stream: word(0), from: word(8), missing: word(16), rows, values }
}
