// Plot series with roles instead of colours, and drawing on a canvas or as SVG.

export type Role = 'measured' | 'fitted' | 'desired' | 'own' | 'rendered' | 'reference' | 'trace-1' | 'trace-2' | 'trace-3'
type Numbers = readonly (number | null)[]

/** `aside`: has its own label and is excluded from the values under the pointer. */
export type Series = { role: Role; name: string; x: Numbers; y: Numbers; aside?: boolean } & (
  /** `dash`: replaces the dashes of the role. `end`: the name is drawn at the end of the line. */
  | { mark: 'line'; provisional?: boolean; dash?: number[]; end?: boolean }
  /** `cross`: drawn as poles. */
  | { mark: 'points'; size: number; half?: Numbers; hollow?: boolean; cross?: boolean }
  | { mark: 'band'; half: Numbers }
)

/** Position of a value [px]. */
export type Place = { x: (value: number) => number; y: (value: number) => number }

/** Screen positions of values, and the inverse [px]. */
export type Frame = { key: string; left: number; top: number; width: number; height: number } & Place & { xAt: (place: number) => number; yAt: (place: number) => number }

/** A point for the arrow keys, with its text. */
export type Stop = { x: number; y: number; text: string }

/** A drawing backend: a canvas or SVG text. */
export type Pen = {
  /** Device pixels per page pixel. */
  scale: number
  line: (path: [number, number][][], colour: string, width: number, dash: number[]) => void
  area: (path: [number, number][], colour: string, opacity: number) => void
  dot: (x: number, y: number, radius: number, colour: string, opacity: number) => void
  /** Text that ends at a position. */
  text: (x: number, y: number, words: string, colour: string) => void
}

const LINES: Record<Role, { width: number; dash: number[] }> = {
  measured: { width: 1, dash: [] },
  fitted: { width: 2, dash: [] },
  desired: { width: 2.6, dash: [] },
  own: { width: 1.8, dash: [9, 4, 2, 4] },
  rendered: { width: 2, dash: [] },
  reference: { width: 1.3, dash: [4, 4] },
  'trace-1': { width: 1.4, dash: [] },
  'trace-2': { width: 1.4, dash: [] },
  'trace-3': { width: 1.4, dash: [] },
}

/** Draws a series. */
export function draw(pen: Pen, series: Series, place: Place, colour: (role: Role) => string) {
  const ink = colour(series.role)
  const { x, y } = series
  if (series.mark === 'points') {
    for (let i = 0; i < x.length; i++) {
      const [px, py, half] = [x[i], y[i], series.half?.[i]]
      if (px == null || py == null) continue
      const at = place.x(px)
      if (half) pen.line([[[at, place.y(py - half)], [at, place.y(py + half)]]], ink, 1, [])
      if (series.cross) {
        const [arm, y] = [series.size * pen.scale, place.y(py)]
        pen.line([[[at - arm, y - arm], [at + arm, y + arm]], [[at - arm, y + arm], [at + arm, y - arm]]], ink, 1.8, [])
      } else pen.dot(at, place.y(py), series.size, ink, series.size < 2 ? 0.7 : 1)
    }
    return
  }
  const parts: { from: number; to: number }[] = []
  let from = -1
  for (let i = 0; i <= x.length; i++) {
    const gap = i === x.length || x[i] == null || y[i] == null
    if (gap && from >= 0) parts.push({ from, to: i })
    from = gap ? -1 : from < 0 ? i : from
  }
  if (series.mark === 'band') {
    for (const { from, to } of parts) {
      const edge: [number, number][] = []
      for (let i = from; i < to; i++) edge.push([place.x(x[i]!), place.y(y[i]! + (series.half[i] ?? 0))])
      for (let i = to - 1; i >= from; i--) edge.push([place.x(x[i]!), place.y(y[i]! - (series.half[i] ?? 0))])
      pen.area(edge, ink, 0.2)
    }
    return
  }
  const { width } = LINES[series.role]
  const dash = series.dash ?? LINES[series.role].dash
  const path = parts.map(({ from, to }) => {
    const part: [number, number][] = []
    for (let i = from; i < to; i++) part.push([place.x(x[i]!), place.y(y[i]!)])
    return part
  })
  pen.line(path, ink, width, dash)
  const last = path.at(-1)?.at(-1)
  if (series.end && last) pen.text(...last, series.name, ink)
}

/** Draws on a canvas with `scale` device pixels per page pixel. */
export function canvasPen(context: CanvasRenderingContext2D, scale: number): Pen {
  return {
    scale,
    line(path, colour, width, dash) {
      context.strokeStyle = colour
      context.lineWidth = width * scale
      context.lineJoin = 'round'
      context.setLineDash(dash.map((length) => length * scale))
      context.beginPath()
      for (const part of path) part.forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)))
      context.stroke()
      context.setLineDash([])
    },
    area(path, colour, opacity) {
      context.fillStyle = colour
      context.globalAlpha = opacity
      context.beginPath()
      path.forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)))
      context.fill()
      context.globalAlpha = 1
    },
    dot(x, y, radius, colour, opacity) {
      context.fillStyle = colour
      context.globalAlpha = opacity
      context.beginPath()
      context.arc(x, y, radius * scale, 0, 2 * Math.PI)
      context.fill()
      context.globalAlpha = 1
    },
    text(x, y, words, colour) {
      context.fillStyle = colour
      context.font = `${11.5 * scale}px Inter, system-ui`
      context.textAlign = 'right'
      context.fillText(words, x, y - 5 * scale)
    },
  }
}

/** The range of all values with a margin; `null` without values. */
export function extent(all: Series[], axis: 'x' | 'y'): [number, number] | null {
  let [low, high] = [Infinity, -Infinity]
  for (const series of all) {
    const half = series.mark === 'points' && axis === 'y' ? series.half : undefined
    series[axis].forEach((value, index) => {
      if (value == null || !Number.isFinite(value)) return
      low = Math.min(low, value - (half?.[index] ?? 0))
      high = Math.max(high, value + (half?.[index] ?? 0))
    })
  }
  return low <= high ? [low, high] : null
}
