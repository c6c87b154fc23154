// One signal over another: the first signal of a pane is the horizontal axis.

import * as drawing from './draw'
import type { Ring } from './ring'
import type { Shown } from './Pane.svelte'

type Range = [number, number]
/** The previous ranges, kept while the data fit well. */
export type Before = { wide: Range | null; high: Range | null }

export function draw(context: CanvasRenderingContext2D, width: number, height: number, ring: Ring, view: { from: number; to: number }, visible: Shown[], before: Before, chosen: Range | null, cursors: (number | null)[], colours: ReturnType<typeof drawing.colours>) {
  const [across, ...up] = visible
  if (!across || !up.length) return
  before.wide = drawing.steps(drawing.range(ring, [across.index], view), before.wide)
  before.high = drawing.steps(drawing.range(ring, up.map((one) => one.index), view), before.high)
  const [from, to] = before.wide
  const box = drawing.box(width, height, true, { from, to }, chosen ?? before.high)
  drawing.grid(context, box, colours, (value) => value)
  const label = [across.signal.label, across.signal.printed_unit].filter(Boolean).join(', ')
  drawing.axes(context, box, colours, drawing.unitOf(up.map((one) => one.signal)), [], { at: (value) => value, label })
  context.save()
  context.beginPath()
  context.rect(box.left, box.top, box.right - box.left, box.bottom - box.top)
  context.clip()
  const place = (a: number, b: number): Range => [
    box.left + ((a - box.from) / (box.to - box.from)) * (box.right - box.left),
    box.bottom - ((b - box.low) / (box.high - box.low)) * (box.bottom - box.top),
  ]
  for (const one of up) drawing.across(context, ring, view, across.index, place, { index: one.index, colour: colours.traces[one.colour]!, dash: one.dash })
  context.fillStyle = colours.text
  for (const cycle of cursors) {
    if (cycle === null) continue
    for (const one of up) {
      const [x, y] = place(ring.value(across.index, cycle), ring.value(one.index, cycle))
      context.beginPath()
      context.arc(x, y, 4, 0, 2 * Math.PI)
      context.fill()
    }
  }
  context.restore()
}
