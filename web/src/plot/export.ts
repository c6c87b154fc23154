// A figure as SVG, PNG or CSV, in light style with a legend, independent of the theme.

import { draw, type Pen, type Role, type Series } from './series'

export type Figure = {
  title: string
  x: { label: string; range: [number, number]; ticks: number[]; warp: (value: number) => number; text: (value: number) => string }
  y: { label: string; range: [number, number]; ticks: number[]; text: (value: number) => string }
  series: Series[]
}

const WIDTH = 900
const HEIGHT = 520
const BOX = { left: 76, right: 20, top: 56, bottom: 52 }

function light(): (name: string) => string {
  const probe = document.createElement('div')
  probe.dataset.theme = 'light'
  document.body.append(probe)
  const style = getComputedStyle(probe)
  const names = ['ink', 'text-2', 'grid', 'axis', 'measured', 'fitted', 'desired', 'own', 'rendered', 'reference', 'trace-1', 'trace-2', 'trace-3']
  const values = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]))
  probe.remove()
  return (name) => values[name] ?? '#000'
}

const escaped = (text: string) => text.replaceAll('&', '&amp;').replaceAll('<', '&lt;')

/** Stacked figures with a common axis. */
export function stacked(figures: Figure[]): string {
  const height = figures.length > 1 ? 320 : HEIGHT
  const part = (figure: Figure, i: number) => svg(figure, height).replace('<svg ', `<svg y="${i * height}" `)
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${WIDTH}" height="${height * figures.length}">${figures.map(part).join('')}</svg>`
}

export function svg(figure: Figure, height = HEIGHT): string {
  const colour = light()
  const { x, y } = figure
  const [right, bottom] = [WIDTH - BOX.right, height - BOX.bottom]
  const [low, high] = x.range.map(x.warp) as [number, number]
  const px = (value: number) => BOX.left + ((x.warp(value) - low) / (high - low)) * (right - BOX.left)
  const py = (value: number) => bottom - ((value - y.range[0]) / (y.range[1] - y.range[0])) * (bottom - BOX.top)
  const parts: string[] = []
  const round = (value: number) => value.toFixed(1)
  const pen: Pen = {
    scale: 1,
    line: (path, ink, width, dash) => {
      const d = path.map((part) => part.map(([a, b], i) => `${i ? 'L' : 'M'}${round(a)} ${round(b)}`).join('')).join('')
      const dashes = dash.length ? ` stroke-dasharray="${dash.join(' ')}"` : ''
      parts.push(`<path d="${d}" fill="none" stroke="${ink}" stroke-width="${width}"${dashes}/>`)
    },
    area: (path, ink, opacity) =>
      parts.push(`<path d="M${path.map(([a, b]) => `${round(a)} ${round(b)}`).join('L')}Z" fill="${ink}" fill-opacity="${opacity}"/>`),
    dot: (a, b, radius, ink, opacity) =>
      parts.push(`<circle cx="${round(a)}" cy="${round(b)}" r="${radius}" fill="${ink}" fill-opacity="${opacity}"/>`),
    text: (a, b, words, ink) => parts.push(`<text x="${round(a)}" y="${round(b - 5)}" text-anchor="end" fill="${ink}">${escaped(words)}</text>`),
  }
  const text = (a: number, b: number, words: string, anchor: string, more = '') =>
    `<text x="${round(a)}" y="${round(b)}" text-anchor="${anchor}" fill="${colour('text-2')}" ${more}>${escaped(words)}</text>`
  const grid: string[] = []
  for (const tick of x.ticks) {
    grid.push(`<path d="M${round(px(tick))} ${BOX.top}V${bottom}" stroke="${colour(tick === 0 ? 'axis' : 'grid')}"/>`)
    grid.push(text(px(tick), bottom + 18, x.text(tick), 'middle'))
  }
  for (const tick of y.ticks) {
    grid.push(`<path d="M${BOX.left} ${round(py(tick))}H${right}" stroke="${colour(tick === 0 ? 'axis' : 'grid')}"/>`)
    grid.push(text(BOX.left - 8, py(tick) + 4, y.text(tick), 'end'))
  }
  for (const series of figure.series) draw(pen, series, { x: px, y: py }, (role: Role) => colour(role))
  let at = right
  const legend = figure.series
    .filter((series) => series.name)
    .reverse()
    .map((series) => {
      const entry = `<rect x="${at - 14}" y="26" width="14" height="4" fill="${colour(series.role)}" fill-opacity="${series.mark === 'band' ? 0.3 : 1}"/>`
      const words = text(at - 20, 32, series.name, 'end')
      at -= 40 + 7 * series.name.length
      return entry + words
    })
  return [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${WIDTH}" height="${height}" viewBox="0 0 ${WIDTH} ${height}" font-family="Inter, system-ui, sans-serif" font-size="12">`,
    `<rect width="${WIDTH}" height="${height}" fill="#fff"/>`,
    text(BOX.left, 32, figure.title, 'start', 'font-weight="600" font-size="14"'),
    ...grid,
    `<clipPath id="box"><rect x="${BOX.left}" y="${BOX.top}" width="${right - BOX.left}" height="${bottom - BOX.top}"/></clipPath>`,
    `<g clip-path="url(#box)">${parts.join('')}</g>`,
    ...legend,
    text((BOX.left + right) / 2, height - 12, x.label, 'middle'),
    text(0, 0, y.label, 'middle', `transform="translate(18 ${(BOX.top + bottom) / 2}) rotate(-90)"`),
    '</svg>',
  ].join('')
}

export function csv(figure: Figure): string {
  const rows = [['series', figure.x.label, figure.y.label, 'half width 95 %'].map((name) => `"${name}"`).join(',')]
  for (const series of figure.series)
    series.x.forEach((x, index) => {
      const y = series.y[index]
      if (x == null || y == null) return
      const half = 'half' in series ? series.half?.[index] : undefined
      rows.push([`"${series.name}"`, x, y, half ?? ''].join(','))
    })
  return `${rows.join('\n')}\n`
}

export function save(name: string, kind: string, content: BlobPart) {
  const link = document.createElement('a')
  link.href = URL.createObjectURL(new Blob([content], { type: kind }))
  link.download = name
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 1000)
}

export function png(figure: Figure): Promise<Blob> {
  return raster(svg(figure), WIDTH, HEIGHT)
}

/** The image of an SVG at twice the resolution. */
export async function raster(text: string, width: number, height: number): Promise<Blob> {
  const url = URL.createObjectURL(new Blob([text], { type: 'image/svg+xml' }))
  const image = new Image()
  image.src = url
  await image.decode()
  URL.revokeObjectURL(url)
  const canvas = document.createElement('canvas')
  ;[canvas.width, canvas.height] = [2 * width, 2 * height]
  canvas.getContext('2d')?.drawImage(image, 0, 0, 2 * width, 2 * height)
  return new Promise((resolve, reject) => canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('no image'))), 'image/png'))
}
