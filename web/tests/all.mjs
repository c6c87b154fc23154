// All stories. Each has a program and a browser of its own, and waits for the clock of its axis most of the time: three at a
// time keep two cores busy.

import { spawn } from 'node:child_process'
import { join } from 'node:path'

const AT_ONCE = 3
// The longest first.
const waiting = [
  'at-rest',
  'newcomer',
  'scope',
  'experiment',
  'help',
  'design',
  'controller',
  'implementation',
  'runs',
  'narrow',
  'simulation',
  'controllers',
  'loaded',
]
const failed = []

/** Runs a story; what it says is told in one piece, once it has ended. */
function played(story) {
  const begun = Date.now()
  const child = spawn(process.execPath, [join(import.meta.dirname, `${story}.mjs`)], { stdio: ['ignore', 'pipe', 'pipe'] })
  const said = []
  child.stdout.on('data', (piece) => said.push(piece))
  child.stderr.on('data', (piece) => said.push(piece))
  return new Promise((ended) =>
    child.once('close', (code) => {
      process.stdout.write(`${Buffer.concat(said)}${story}: ${((Date.now() - begun) / 1000).toFixed(0)} s\n`)
      if (code !== 0) failed.push(story)
      ended()
    }),
  )
}

async function work() {
  for (let story = waiting.shift(); story; story = waiting.shift()) await played(story)
}

await Promise.all(Array.from({ length: AT_ONCE }, work))
if (failed.length) {
  console.error(`failed: ${failed.join(', ')}`)
  process.exitCode = 1
}
