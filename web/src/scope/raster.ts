// Many samples per pixel, as pixels: each column of a trace is a vertical run from its minimum to its maximum, with soft ends.
// Canvas paths take ten times as long without a graphics processor.

import type { Box } from './draw'
import type { Ring } from './ring'

/** Half of the line width [px]. */
const HALF = 0.7

export class Raster {
  #canvas: HTMLCanvasElement
  #image: ImageData | null = null
  #pixels = new Uint32Array(0)
  #low = new Float64Array(0)
  #high = new Float64Array(0)
  #clean = true

  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas
  }

  /** Clears the picture and sets its size [device pixels]. */
  start(width: number, height: number) {
    if (this.#image?.width !== width || this.#image.height !== height) {
      ;[this.#canvas.width, this.#canvas.height] = [width, height]
      this.#image = new ImageData(width, height)
      this.#pixels = new Uint32Array(this.#image.data.buffer)
      ;[this.#low, this.#high] = [new Float64Array(width + 2), new Float64Array(width + 2)]
    } else this.#pixels.fill(0)
  }

  /** A trace; `ink` is its colour as a pixel without alpha. */
  trace(ring: Ring, index: number, box: Box, ink: number, dash: number[]) {
    const image = this.#image
    if (!image) return
    const { width, height } = image
    const [pixels, lows, highs] = [this.#pixels, this.#low, this.#high]
    const step = (box.to - box.from) / width
    // Columns stay aligned with their samples while scrolling.
    const column = Math.floor(box.from / step)
    ring.extremes(index, column * step, step, width, lows, highs)
    const up = height / (box.high - box.low)
    const half = HALF * devicePixelRatio
    const period = dash.reduce((sum, part) => sum + part, 0)
    let [topBefore, bottomBefore] = [NaN, NaN]
    for (let x = 0; x < width; x++) {
      let top = height - (highs[x]! - box.low) * up
      let bottom = height - (lows[x]! - box.low) * up
      const [topHere, bottomHere] = [top, bottom]
      if (top !== top) {
        topBefore = NaN
        continue
      }
      // Connects to the previous column.
      if (topBefore > bottom) bottom = topBefore
      if (bottomBefore < top) top = bottomBefore
      ;[topBefore, bottomBefore] = [topHere, bottomHere]
      if (period && off(dash, (column + x) % period)) continue
      top = Math.max(0, top - half)
      bottom = Math.min(height, bottom + half)
      if (bottom <= top) continue
      const [first, last] = [Math.floor(top), Math.min(height - 1, Math.floor(bottom))]
      for (let y = first, at = first * width + x; y <= last; y++, at += width) {
        const covered = Math.min(bottom, y + 1) - Math.max(top, y)
        const alpha = covered >= 1 ? 255 : (covered * 255) | 0
        if (alpha > 127 || pixels[at]! >>> 24 < alpha) pixels[at] = (Math.max(alpha, pixels[at]! >>> 24) << 24) | ink
      }
    }
  }

  /** Displays the drawing since `start`. */
  show() {
    if (!this.#image) return
    this.#canvas.getContext('2d')?.putImageData(this.#image, 0, 0)
    this.#clean = false
  }

  /** Displays nothing. */
  clear() {
    if (this.#clean) return
    this.#canvas.getContext('2d')?.clearRect(0, 0, this.#canvas.width, this.#canvas.height)
    this.#clean = true
  }
}

function off(dash: number[], at: number): boolean {
  for (let i = 0; i < dash.length; i++) {
    at -= dash[i]!
    if (at < 0) return i % 2 === 1
  }
  return false
}

/** A colour `#rrggbb` as a pixel without alpha. */
export function ink(colour: string): number {
  const value = parseInt(colour.slice(1), 16)
  return ((value & 0xff) << 16) | (value & 0xff00) | (value >> 16)
}
