// All stories. Each has a program and a browser of its own, and waits for the clock of its axis most of the time: two at a
// time keep two cores busy, and leave the benches enough of them on a machine that is shared.

import { spawn } from 'node:child_process'
import { join } from 'node:path'

const AT_ONCE = 2
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
/** What a bench says where the machine has left it without a processor. */
const STARVED = 'fell behind the clock'

/** Runs a story; what it says is told in one piece, once it has ended. Told is how it went. */
function played(story) {
  const begun = Date.now()
  const child = spawn(process.execPath, [join(import.meta.dirname, `${story}.mjs`)], { stdio: ['ignore', 'pipe', 'pipe'] })
  const said = []
  child.stdout.on('data', (piece) => said.push(piece))
  child.stderr.on('data', (piece) => said.push(piece))
  return new Promise((ended) =>
    child.once('close', (code) => {
      const text = Buffer.concat(said).toString()
      process.stdout.write(`${text}${story}: ${((Date.now() - begun) / 1000).toFixed(0)} s\n`)
      ended({ story, passed: code === 0, starved: text.includes(STARVED) })
    }),
  )
}

/** Plays what is waiting, so many at a time; told are those that failed. */
async function playedAll(waiting, atOnce) {
  const failed = []
  const work = async () => {
    for (let story = waiting.shift(); story; story = waiting.shift()) {
      const ended = await played(story)
      if (!ended.passed) failed.push(ended)
    }
  }
  await Promise.all(Array.from({ length: atOnce }, work))
  return failed
}
const names = (stories) => stories.map(({ story }) => story)

// A bench by the clock may fail because browsers want both cores: what fails beside others is played once more, alone; and
// twice more where the bench itself says that the machine has left it without a processor.
const beside = await playedAll(waiting, AT_ONCE)
const alone = await playedAll(names(beside), 1)
const failed = alone.filter(({ starved }) => !starved)
let starved = alone.filter(({ starved }) => starved)
for (let tries = 0; tries < 2 && starved.length; tries++) starved = await playedAll(names(starved), 1)
failed.push(...starved)
if (beside.length) console.error(`failed beside others: ${names(beside).join(', ')}`)
if (failed.length) {
  console.error(`failed alone as well: ${names(failed).join(', ')}`)
  process.exitCode = 1
}
