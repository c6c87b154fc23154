// All commands and their keys. Palette, tooltips, the table of keys and the keyboard use this list.

import { bench } from './bench.svelte'
import { entered } from './entered.svelte'
import { stop } from './stop.svelte'
import { go, view } from './view.svelte'

/** `hold`: acts while the key is held; key repeat is ignored. */
export type Command = { name: string; key: string; run: () => void; off?: () => string | null; hold?: boolean }

/** Additional commands of the current window. */
export const local: { commands: Command[] } = { commands: [] }

/** Commands of the scope, and whether its keys have priority. */
export const dock: { commands: () => Command[]; first: () => boolean } = { commands: () => [], first: () => false }

export const WINDOWS = [
  { path: '/', name: 'Home', key: '1' },
  { path: '/friction', name: 'Friction Measurement', key: '2' },
  { path: '/design', name: 'Friction Design', key: '3' },
  { path: '/controller', name: 'Controller Design', key: '4' },
  { path: '/test', name: 'Test', key: '5' },
  { path: '/simulation', name: 'Simulation', key: '6' },
  { path: '/implementation', name: 'Implementation', key: '7' },
  { path: '/runs', name: 'Runs', key: '8' },
  { path: '/help', name: 'Help', key: '9' },
] as const

/** Stops the axis at any time, also from a text field or dialog. */
export const STOP_KEY = 'F8'

const common: Command[] = [
  { name: 'Stop', key: STOP_KEY, run: () => stop.press() },
  ...WINDOWS.map(({ path, name, key }) => ({ name, key, run: () => go(path) })),
  { name: 'Home axis', key: '', run: () => void bench.command({ call: 'home' }), off: () => bench.busy },
  { name: 'Arm', key: '', run: () => void bench.command({ call: 'arm' }), off: () => bench.busy },
  { name: 'Torque on', key: '', run: () => void bench.command({ call: 'start' }), off: () => bench.busy },
  { name: 'Switch off', key: '', run: () => void bench.command({ call: 'off' }), off: () => bench.blocked },
  { name: 'Undo', key: 'Ctrl Z', run: () => (entered.any ? entered.undo() : void bench.undo()), off: () => bench.blocked },
  { name: 'Find or run', key: 'Ctrl K', run: () => (view.palette = true) },
  { name: 'Keys', key: '?', run: () => (view.keys = true) },
  { name: 'Parameter sets', key: '', run: () => (view.sets = true) },
  { name: 'Settings', key: '', run: () => (view.settings = true) },
  { name: 'Close', key: '', run: () => (view.ending = true) },
  { name: 'Messages', key: 'Shift M', run: () => (view.log = true) },
  { name: 'Speed unit', key: 'U', run: () => bench.nextSpeed() },
  { name: 'Theme', key: 'Shift D', run: () => bench.nextTheme() },
  { name: 'Take control', key: '', run: () => void bench.command({ call: 'operate' }) },
]

export function commands(): Command[] {
  const below = dock.commands()
  return dock.first() ? [...below, ...local.commands, ...common] : [...local.commands, ...common, ...below]
}

const NAMES: Record<string, string> = { ' ': 'Space' }

/** The name of a pressed key in the table. */
export function keyName(event: KeyboardEvent): string {
  const key = NAMES[event.key] ?? (event.key.length === 1 ? event.key.toUpperCase() : event.key)
  const shifted = event.shiftKey && /^[A-Z]$/.test(key)
  return `${event.ctrlKey || event.metaKey ? 'Ctrl ' : ''}${shifted ? 'Shift ' : ''}${key}`
}
