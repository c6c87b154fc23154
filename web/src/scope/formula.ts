// A channel that is computed from signals, cycle by cycle: what a user types, `slip = setpoint.velocity - d(angle)`.

import jsep from 'jsep'

/** The value of a channel in the cycle that lies in a slot; cycles come in their order. */
export type Step = (columns: readonly Float64Array[], slot: number) => number
export type Formula = {
  name: string
  text: string
  /** Anew, knowing nothing of cycles before. */
  begin: () => Step
}

/** What is wrong with what was typed, in words. */
export class Unreadable extends Error {}

type Maker = () => Step
type CoreExpression = jsep.CoreExpression
type Known = { index: (name: string) => number; rate: number }

const BINARY: Record<string, (a: number, b: number) => number> = { '+': (a, b) => a + b, '-': (a, b) => a - b, '*': (a, b) => a * b, '/': (a, b) => a / b, '^': (a, b) => a ** b }
const PLAIN: Record<string, (...values: number[]) => number> = { abs: Math.abs, sqrt: Math.sqrt, sin: Math.sin, cos: Math.cos, sign: Math.sign, min: Math.min, max: Math.max }
/** How many values each takes. */
const TAKES: Record<string, number> = { abs: 1, sqrt: 1, sin: 1, cos: 1, sign: 1, min: 2, max: 2, d: 1, lowpass: 2 }

jsep.addBinaryOp('^', 11, true)

/** What can be typed, for people. */
export const HELP = '+ − * / ^, abs, sqrt, sign, sin, cos, min, max, pi; d(x): derivative; lowpass(x, Hz)'

/** Reads `name = formula` or `formula`. @throws {Unreadable} */
export function read(typed: string, known: Known): Formula {
  const [, name, text] = /^\s*(?:([^=]*?)\s*=)?\s*(.*?)\s*$/s.exec(typed)!
  if (!text) throw new Unreadable('Type a formula: setpoint.velocity - software.estimated_velocity')
  let tree: jsep.Expression
  try {
    tree = jsep(text)
  } catch (error) {
    throw new Unreadable(`It cannot be read: ${error instanceof Error ? error.message : String(error)}`)
  }
  return { name: name || text, text, begin: made(tree as CoreExpression, known) }
}

function made(tree: CoreExpression, known: Known): Maker {
  switch (tree.type) {
    case 'Literal': {
      const { value } = tree
      if (typeof value !== 'number') throw new Unreadable(`${tree.raw} is no number`)
      return () => () => value
    }
    case 'Identifier':
    case 'MemberExpression': {
      const name = named(tree)
      if (name === 'pi') return () => () => Math.PI
      const index = known.index(name)
      if (index < 0) throw new Unreadable(`${name} is no signal; + in the list writes its name`)
      return () => (columns, slot) => columns[index]![slot]!
    }
    case 'UnaryExpression': {
      if (tree.operator !== '-' && tree.operator !== '+') throw new Unreadable(`${tree.operator} is not known: ${HELP}`)
      const of = made(tree.argument as CoreExpression, known)
      const sign = tree.operator === '-' ? -1 : 1
      return () => {
        const step = of()
        return (columns, slot) => sign * step(columns, slot)
      }
    }
    case 'BinaryExpression': {
      const operation = BINARY[tree.operator]
      if (!operation) throw new Unreadable(`${tree.operator} is not known: ${HELP}`)
      const [left, right] = [made(tree.left as CoreExpression, known), made(tree.right as CoreExpression, known)]
      return () => {
        const [a, b] = [left(), right()]
        return (columns, slot) => operation(a(columns, slot), b(columns, slot))
      }
    }
    case 'CallExpression':
      return called(named(tree.callee as CoreExpression), tree.arguments as CoreExpression[], known)
    default:
      throw new Unreadable(`One formula only: ${HELP}`)
  }
}

function called(name: string, given: CoreExpression[], known: Known): Maker {
  if (!Object.hasOwn(TAKES, name)) throw new Unreadable(`${name}() is not known: ${HELP}`)
  if (given.length !== TAKES[name]) throw new Unreadable(`${name}() takes ${TAKES[name] === 1 ? 'one value' : `${TAKES[name]} values`}`)
  const makers = given.map((one) => made(one, known))
  return () => {
    const steps = makers.map((maker) => maker())
    const [x, second] = steps as [Step, Step]
    if (name === 'd') return derivative(x, known.rate)
    if (name === 'lowpass') return lowpass(x, second, known.rate)
    const plain = PLAIN[name]!
    return (columns, slot) => plain(...steps.map((step) => step(columns, slot)))
  }
}

function named(tree: CoreExpression): string {
  if (tree.type === 'Identifier') return tree.name
  if (tree.type === 'MemberExpression' && !tree.computed) return `${named(tree.object as CoreExpression)}.${named(tree.property as CoreExpression)}`
  throw new Unreadable(`One formula only: ${HELP}`)
}

/** From cycle to cycle. */
function derivative(x: Step, rate: number): Step {
  let before = NaN
  return (columns, slot) => {
    const value = x(columns, slot)
    const slope = (value - before) * rate
    before = value
    return slope
  }
}

/** Of first order, its cut-off in hertz. */
function lowpass(x: Step, cutOff: Step, rate: number): Step {
  let state = NaN
  return (columns, slot) => {
    const value = x(columns, slot)
    const part = 1 - Math.exp((-2 * Math.PI * cutOff(columns, slot)) / rate)
    state = Number.isNaN(state) ? value : state + part * (value - state)
    return state
  }
}
