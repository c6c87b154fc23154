// All stories. Each has a program and a browser of its own, and waits for the clock of its axis most of the time: three at
// a time keep two cores busy, and their virtual machines wait where there is none left.

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

/** Runs a story; what it says is told in one piece, once it has ended. Told is whether it passed. */
function played(story) {
  const begun = Date.now()
  const child = spawn(process.execPath, [join(import.meta.dirname, `${story}.mjs`)], { stdio: ['ignore', 'pipe', 'pipe'] })
  const said = []
  child.stdout.on('data', (piece) => said.push(piece))
  child.stderr.on('data', (piece) => said.push(piece))
  return new Promise((ended) =>
    child.once('close', (code) => {
      process.stdout.write(`${Buffer.concat(said)}${story}: ${((Date.now() - begun) / 1000).toFixed(0)} s\n`)
      ended(code === 0)
    }),
  )
}

/** Plays what is waiting, so many at a time; told are those that failed. */
async function playedAll(waiting, atOnce) {
  const failed = []
  const work = async () => {
    for (let story = waiting.shift(); story; story = waiting.shift()) {
      if (!(await played(story))) failed.push(story)
    }
  }
  await Promise.all(Array.from({ length: atOnce }, work))
  return failed
}

// Browsers want both cores: what fails beside others is played once more, alone.
const beside = await playedAll(waiting, AT_ONCE)
const failed = await playedAll([...beside], 1)
if (beside.length) console.error(`failed beside others: ${beside.join(', ')}`)
if (failed.length) {
  console.error(`failed alone as well: ${failed.join(', ')}`)
  process.exitCode = 1
}
