// All stories, one after the other: each has a program and a browser of its own, and the axis its clock.

for (const story of ['experiment', 'design', 'newcomer', 'at-rest', 'runs', 'simulation', 'implementation', 'help', 'scope', 'narrow']) {
  const begun = Date.now()
  await import(`./${story}.mjs`)
  console.log(`${story}: ${((Date.now() - begun) / 1000).toFixed(0)} s`)
}
