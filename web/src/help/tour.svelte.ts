// The experiment of the paper on the running bench, step by step; each step waits for the action of the user.

import { bench } from '../bench.svelte'
import { design } from '../design/design.svelte'
import { steps } from '../guide.svelte'
import { measurement } from '../measurement.svelte'
import { view } from '../view.svelte'

export type Stop = {
  title: string
  text: string
  /** The window of the step. */
  at: string
  /** The control to use. */
  target: () => Element | null
  done: () => boolean
}

/** The first control with a matching name. */
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
    text: 'The encoder counts from its position at power-on. Homing switches the drive on and searches the index, which sets the zero of the angle. Stop (top right) or F8 brakes at any time; Esc does so if no menu or dialog is open.',
    at: '/',
    target: () => control(/^Home axis/),
    done: () => bench.homed,
  },
  {
    title: 'Go to the measurement',
    text: 'The load motor renders the difference between desired and own friction. Therefore the own friction is measured first.',
    at: '/',
    target: link('/friction'),
    done: () => view.path === '/friction',
  },
  {
    title: 'Measure the friction',
    text: 'The axis runs at a sequence of speeds in both directions. Each speed gives a point. The Stribeck curve is fitted during the measurement; parameters that the data do not yet determine are marked. The recipe next to the button shows the speeds and the duration.',
    at: '/friction',
    target: () => control(/^(Measure|Cancel)/),
    done: fitted,
  },
  {
    title: 'Download the own friction',
    text: 'The fit becomes the own friction in the model of the bench. The dialog lists the changes before they apply; Undo restores the previous values.',
    at: '/friction',
    target: () => document.querySelector('[role=dialog] .primary') ?? control(/^Download/),
    done: () => fitted() && measurement.downloaded,
  },
  {
    title: 'Go to the design',
    text: 'Define the desired friction.',
    at: '/friction',
    target: link('/design'),
    done: () => view.path === '/design',
  },
  {
    title: 'Draw the desired friction',
    text: 'Drag the handles of the curve (breakaway torque, kinetic torque, Stribeck velocity, viscous friction), or set points. The hatched range cannot be rendered; the margin shows the distance to the nearest limit.',
    at: '/design',
    target: () => document.querySelector('main [role=slider]') ?? document.querySelector('main .canvas'),
    done: () => design.changes > 0 || design.downloaded,
  },
  {
    title: 'Download the desired friction',
    text: 'From the next cycle, the load motor renders the difference between desired and own friction.',
    at: '/design',
    target: () => document.querySelector('[role=dialog] .primary') ?? control(/^Download/),
    done: () => design.downloaded && design.changes === 0,
  },
  {
    title: 'Measure again',
    text: 'The same recipe with the load motor rendering; the axis moves. Figures 12 to 14 of the paper show your data and the error.',
    at: '/design',
    target: () => control(/^(Measure again|Cancel)/),
    done: () => step('Measure again'),
  },
  {
    title: 'Save the report',
    text: 'A single HTML page with own, desired and rendered friction, all figures, parameters and the program version.',
    at: '/friction',
    target: () => control(/^Save report/),
    done: () => step('Report'),
  },
  {
    title: 'Go to the test',
    text: 'A controller is tested on the friction: jog the axis, let the controller follow a manoeuvre, or compare controllers.',
    at: '/friction',
    target: link('/test'),
    done: () => view.path === '/test' || step('Compare'),
  },
  {
    title: 'Compare two controllers',
    text: 'Choose the controllers and a manoeuvre. Each follows it several times on the same friction; the ranking has an interval from the repetitions. The active controller is restored at the end.',
    at: '/test?compare',
    target: () => control(/^(Compare, |Cancel)/) ?? control(/^Compare controllers/),
    done: () => step('Compare'),
  },
]

class Tour {
  /** Index of the current step; null without a tour. */
  at = $state<number | null>(null)
  /** A control highlighted for a while. */
  shown = $state.raw<{ title: string; target: () => Element | null } | null>(null)
  stop = $derived(this.at === null ? null : (STOPS[this.at] ?? null))
  ended = $derived(this.at !== null && this.at >= STOPS.length)

  start() {
    // Completed steps are skipped.
    const next = STOPS.findIndex((stop) => !stop.done())
    this.at = next < 0 ? 0 : next
    view.go(STOPS[this.at]!.at)
  }

  go(to: number) {
    this.at = Math.max(0, to)
    const stop = STOPS[this.at]
    if (stop && view.path !== stop.at.split('?')[0] && !stop.done()) view.go(stop.at)
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
