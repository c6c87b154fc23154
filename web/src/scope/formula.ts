// A channel computed from signals in each cycle, as entered by the user: `slip = setpoint.velocity - d(angle)`.

import jsep from 'jsep'

/** The value of a channel in the cycle at an index; called in the order of the cycles. */
export type Step = (columns: readonly Float64Array[], slot: number) => number
export type Formula = {
  name: string
  text: string
  /** Starts without a history. */
  start: () => Step
}

/** An error in the input, as a message. */
export class Unreadable extends Error {}

type Maker = () => Step
type CoreExpression = jsep.CoreExpression
type Context = { index: (name: string) => number; rate: number }

const BINARY: Record<string, (a: number, b: number) => number> = { '+': (a, b) => a + b, '-': (a, b) => a - b, '*': (a, b) => a * b, '/': (a, b) => a / b, '^': (a, b) => a ** b }
const PLAIN: Record<string, (...values: number[]) => number> = { abs: Math.abs, sqrt: Math.sqrt, sin: Math.sin, cos: Math.cos, sign: Math.sign, min: Math.min, max: Math.max }
/** Number of arguments of each function. */
const TAKES: Record<string, number> = { abs: 1, sqrt: 1, sin: 1, cos: 1, sign: 1, min: 2, max: 2, d: 1, lowpass: 2 }

jsep.addBinaryOp('^', 11, true)

/** Summary of the syntax. */
export const HELP = '+ − * / ^, abs, sqrt, sign, sin, cos, min, max, pi; d(x): derivative; lowpass(x, Hz)'

/** Parses `name = formula` or `formula`. @throws {Unreadable} */
export function read(typed: string, context: Context): Formula {
  const [, name, text] = /^\s*(?:([^=]*?)\s*=)?\s*(.*?)\s*$/s.exec(typed)!
  if (!text) throw new Unreadable('Enter a formula: setpoint.velocity - software.estimated_velocity')
  let tree: jsep.Expression
  try {
    tree = jsep(text)
  } catch (error) {
    throw new Unreadable(`Syntax error: ${error instanceof Error ? error.message : String(error)}`)
  }
  return { name: name || text, text, start: build(tree as CoreExpression, context) }
}

function build(tree: CoreExpression, context: Context): Maker {
  switch (tree.type) {
    case 'Literal': {
      const { value } = tree
      if (typeof value !== 'number') throw new Unreadable(`${tree.raw} is not a number`)
      return () => () => value
    }
    case 'Identifier':
    case 'MemberExpression': {
      const name = nameOf(tree)
      if (name === 'pi') return () => () => Math.PI
      const index = context.index(name)
      if (index < 0) throw new Unreadable(`unknown signal ${name}; + in the list inserts a name`)
      return () => (columns, slot) => columns[index]![slot]!
    }
    case 'UnaryExpression': {
      if (tree.operator !== '-' && tree.operator !== '+') throw new Unreadable(`unknown operator ${tree.operator}; allowed: ${HELP}`)
      const of = build(tree.argument as CoreExpression, context)
      const sign = tree.operator === '-' ? -1 : 1
      return () => {
        const step = of()
        return (columns, slot) => sign * step(columns, slot)
      }
    }
    case 'BinaryExpression': {
      const operation = BINARY[tree.operator]
      if (!operation) throw new Unreadable(`unknown operator ${tree.operator}; allowed: ${HELP}`)
      const [left, right] = [build(tree.left as CoreExpression, context), build(tree.right as CoreExpression, context)]
      return () => {
        const [a, b] = [left(), right()]
        return (columns, slot) => operation(a(columns, slot), b(columns, slot))
      }
    }
    case 'CallExpression':
      return buildCall(nameOf(tree.callee as CoreExpression), tree.arguments as CoreExpression[], context)
    default:
      throw new Unreadable(`Enter a single formula: ${HELP}`)
  }
}

function buildCall(name: string, args: CoreExpression[], context: Context): Maker {
  if (!Object.hasOwn(TAKES, name)) throw new Unreadable(`unknown function ${name}(); allowed: ${HELP}`)
  if (args.length !== TAKES[name]) throw new Unreadable(`${name}() requires ${TAKES[name] === 1 ? 'one value' : `${TAKES[name]} values`}`)
  const makers = args.map((one) => build(one, context))
  return () => {
    const steps = makers.map((maker) => maker())
    const [x, second] = steps as [Step, Step]
    if (name === 'd') return derivative(x, context.rate)
    if (name === 'lowpass') return lowpass(x, second, context.rate)
    const plain = PLAIN[name]!
    return (columns, slot) => plain(...steps.map((step) => step(columns, slot)))
  }
}

function nameOf(tree: CoreExpression): string {
  if (tree.type === 'Identifier') return tree.name
  if (tree.type === 'MemberExpression' && !tree.computed) return `${nameOf(tree.object as CoreExpression)}.${nameOf(tree.property as CoreExpression)}`
  throw new Unreadable(`Enter a single formula: ${HELP}`)
}

/** Difference between cycles. */
function derivative(x: Step, rate: number): Step {
  let before = NaN
  return (columns, slot) => {
    const value = x(columns, slot)
    const slope = (value - before) * rate
    before = value
    return slope
  }
}

/** First order, with the cut-off frequency in Hz. */
function lowpass(x: Step, cutOff: Step, rate: number): Step {
  let state = NaN
  return (columns, slot) => {
    const value = x(columns, slot)
    const part = 1 - Math.exp((-2 * Math.PI * cutOff(columns, slot)) / rate)
    state = Number.isNaN(state) ? value : state + part * (value - state)
    return state
  }
}
