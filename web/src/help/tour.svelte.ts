// The paper's experiment on the real bench, step by step: each waits for the hand of whoever takes it.

import { bench } from '../bench.svelte'
import { design } from '../design/design.svelte'
import { steps } from '../guide.svelte'
import { measurement } from '../measurement.svelte'
import { view } from '../view.svelte'

export type Stop = {
  title: string
  text: string
  /** The window where it happens. */
  at: string
  /** What to touch. */
  target: () => Element | null
  done: () => boolean
}

/** The first control of the window with such a name. */
export function control(name: RegExp, within = 'main'): Element | null {
  const all = document.querySelectorAll<HTMLElement>(`${within} :is(button, a, [role=tab], summary)`)
  for (const one of all) if (name.test((one.getAttribute('aria-label') ?? one.textContent ?? '').trim())) return one
  return null
}

const link = (path: string) => () => document.querySelector(`nav a[href="${path}"]`)
const step = (name: string) => steps().some((one) => one.name === name && one.done)
const fitted = () => measurement.curve?.fit != null && !measurement.curve.measuring

export const STOPS: Stop[] = [
  {
    title: 'Home the axis',
    text: 'The encoder counts from wherever it was switched on. Homing switches the drive on and searches its index, so that each angle has a meaning. Stop, above on the right, or Esc brakes at any time.',
    at: '/',
    target: () => control(/^Home axis/),
    done: () => bench.homed,
  },
  {
    title: 'Go to the measurement',
    text: 'What is to be rendered later is the difference to the friction that is there already. So that comes first.',
    at: '/',
    target: link('/friction'),
    done: () => view.path === '/friction',
  },
  {
    title: 'Measure the friction',
    text: 'The axis runs at one speed after another, both ways. Each gives a point; the Stribeck curve is fitted along, with what the data do not tell yet. The recipe beside the button says how many speeds, and how long.',
    at: '/friction',
    target: () => control(/^(Measure|Cancel)/),
    done: fitted,
  },
  {
    title: 'Download the own friction',
    text: 'The fit becomes what the bench believes of itself. The dialog shows what changes on the target before it does; Undo brings the values before back.',
    at: '/friction',
    target: () => document.querySelector('[role=dialog] .primary') ?? control(/^Download/),
    done: () => fitted() && measurement.downloaded,
  },
  {
    title: 'Go to the design',
    text: 'Now the friction that you want.',
    at: '/friction',
    target: link('/design'),
    done: () => view.path === '/design',
  },
  {
    title: 'Draw the desired friction',
    text: 'Take the curve by its handles, or lay it through points: breakaway, kinetic torque, Stribeck velocity, viscous friction. What the load motor cannot render is hatched; the margin says how far it is from chatter.',
    at: '/design',
    target: () => document.querySelector('main [role=slider]') ?? document.querySelector('main .canvas'),
    done: () => design.changes > 0 || design.downloaded,
  },
  {
    title: 'Download the desired friction',
    text: 'From the next cycle on the load motor renders the difference between the curve that you drew and the friction that is there.',
    at: '/design',
    target: () => document.querySelector('[role=dialog] .primary') ?? control(/^Download/),
    done: () => design.downloaded && design.changes === 0,
  },
  {
    title: 'Measure again',
    text: 'The same recipe, while the load motor renders: the axis moves. Figures 12 to 14 of the paper fill with your own data, and the error stands beside them.',
    at: '/design',
    target: () => control(/^(Measure again|Cancel)/),
    done: () => step('Measure again'),
  },
  {
    title: 'Save the report',
    text: 'Own, desired and rendered friction with all figures, parameters and the version of the program, as one page that stands alone.',
    at: '/friction',
    target: () => control(/^Save report/),
    done: () => step('Report'),
  },
]

class Tour {
  /** Which stop; none where nobody takes it. */
  at = $state<number | null>(null)
  /** A control that is shown by itself, for a while. */
  shown = $state.raw<{ title: string; target: () => Element | null } | null>(null)
  stop = $derived(this.at === null ? null : (STOPS[this.at] ?? null))
  ended = $derived(this.at !== null && this.at >= STOPS.length)

  begin() {
    // What is done already is not asked for again.
    const next = STOPS.findIndex((stop) => !stop.done())
    this.at = next < 0 ? 0 : next
    view.go(STOPS[this.at]!.at)
  }

  go(to: number) {
    this.at = Math.max(0, to)
    const stop = STOPS[this.at]
    if (stop && view.path !== stop.at && !stop.done()) view.go(stop.at)
  }

  leave() {
    this.at = null
  }

  show(title: string, target: () => Element | null) {
    this.shown = { title, target }
    setTimeout(() => (this.shown = null), 4000)
  }
}

export const tour = new Tour()
