// Runs all browser tests. Each test has its own program and browser and mostly waits for its axis in real time: four at a
// time keep two processors busy. Virtual machines wait if no processor is free.

import { spawn } from 'node:child_process'
import { join } from 'node:path'

const AT_ONCE = 4
// The longest first.
const waiting = [
  'at-rest',
  'newcomer',
  'memory',
  'test-window',
  'experiment',
  'design',
  'narrow',
  'ratios',
  'controller',
  'scope',
  'help',
  'entered',
  'runs',
  'implementation',
  'simulation',
  'small',
  'escape',
  'controllers',
  'home',
  'external-controller',
  'segment',
]

/** Runs a test and prints its output when it has ended. Returns whether it passed. */
function runTest(test) {
  const start = Date.now()
  const child = spawn(process.execPath, [join(import.meta.dirname, `${test}.mjs`)], { stdio: ['ignore', 'pipe', 'pipe'] })
  const output = []
  child.stdout.on('data', (piece) => output.push(piece))
  child.stderr.on('data', (piece) => output.push(piece))
  return new Promise((ended) =>
    child.once('close', (code) => {
      process.stdout.write(`${Buffer.concat(output)}${test}: ${((Date.now() - start) / 1000).toFixed(0)} s\n`)
      ended(code === 0)
    }),
  )
}

/** Runs the waiting tests, a few at a time. Returns the failed ones. */
async function runAll(waiting, atOnce) {
  const failed = []
  const work = async () => {
    for (let test = waiting.shift(); test; test = waiting.shift()) {
      if (!(await runTest(test))) failed.push(test)
    }
  }
  await Promise.all(Array.from({ length: atOnce }, work))
  return failed
}

// Browsers need both processors: tests that failed in parallel run once more, alone.
const retried = await runAll(waiting, AT_ONCE)
const failed = await runAll([...retried], 1)
if (retried.length) console.error(`failed in parallel: ${retried.join(', ')}`)
if (failed.length) {
  console.error(`failed alone, too: ${failed.join(', ')}`)
  process.exitCode = 1
}
