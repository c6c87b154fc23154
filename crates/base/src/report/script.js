'use strict';
// Values under the pointer or by arrow keys, and export; all from the data of the page.
const make = (parent, name, properties) => Object.assign(parent.appendChild(document.createElement(name)), properties);
const quote = (text) => `"${text.replaceAll('"', '""')}"`;
const csvHead = ([quantity, unit]) => quote(unit ? `${quantity} [${unit}]` : quantity);
// Buttons that save the drawing of a figure, and its numbers as lines of CSV.
const saving = (figure, caption, drawing, csv) => {
  const save = (name, type, text) => {
    const link = make(document.body, 'a', { href: URL.createObjectURL(new Blob([text], { type })), download: `${figure.id}.${name}` });
    link.click();
    link.remove();
  };
  const tools = document.createElement('div');
  tools.className = 'tools';
  caption.before(tools);
  const button = (text, ariaLabel, onclick) => make(tools, 'button', { type: 'button', textContent: text, ariaLabel, onclick });
  button('SVG', 'Save figure as SVG', () => save('svg', 'image/svg+xml', drawing));
  button('CSV', 'Save data as CSV', () => save('csv', 'text/csv', [...csv(), ''].join('\n')));
};
for (const map of document.querySelectorAll('.map')) {
  const { heads, cells } = JSON.parse(map.querySelector('script').textContent);
  const csv = () => [heads.map(csvHead).join(','), ...cells.map((cell) => cell.join(','))];
  saving(map, map.querySelector('p'), map.querySelector('svg').outerHTML, csv);
}
for (const figure of document.querySelectorAll('figure')) {
  const plot = figure.querySelector('.plot');
  const svg = plot.querySelector('svg');
  const shown = JSON.parse(figure.querySelector('script').textContent);
  const series = shown.series.filter((one) => one.rows.length);
  const drawing = svg.outerHTML;
  // As a title it would pop up over the values.
  const title = svg.querySelector('title');
  plot.setAttribute('role', 'group');
  plot.setAttribute('aria-label', title.textContent + '. Arrow keys read values.');
  svg.setAttribute('aria-label', title.textContent);
  title.remove();

  const tip = make(plot, 'output', { className: 'tip', hidden: true });
  const mark = svg.appendChild(document.createElementNS(svg.namespaceURI, 'circle'));
  for (const [name, value] of Object.entries({ r: 5, fill: 'none', stroke: 'currentColor', 'stroke-width': 2 })) mark.setAttribute(name, value);
  const minus = (value) => (value === null ? 'unknown' : String(value).replace('-', '\u2212'));
  const measure = ([, unit], text) => (unit ? `${text} ${unit}` : text);
  let at = [0, -1];

  const hide = () => { tip.hidden = true; mark.setAttribute('visibility', 'hidden'); };
  const show = (index, row) => {
    at = [index, row];
    const one = series[index];
    const [x, y, ...value] = one.rows[row];
    const text = { band: () => `${minus(value[1])} \u2026 ${minus(value[2])}`, bars: () => `${minus(value[1])} \u00b1 ${minus(value[2])}` };
    tip.replaceChildren();
    make(tip, 'b', { textContent: one.name });
    for (const line of [measure(shown.y, (text[one.kind] || (() => minus(value[1])))()), `at ${measure(shown.x, minus(value[0]))}`]) {
      make(tip, 'br');
      tip.append(line);
    }
    mark.setAttribute('cx', x);
    mark.setAttribute('cy', y);
    mark.setAttribute('class', one.class);
    mark.removeAttribute('visibility');
    tip.hidden = false;
    const scale = svg.clientWidth / svg.viewBox.baseVal.width;
    const left = x * scale, top = y * scale, away = 14;
    tip.style.left = `${left + away + tip.offsetWidth > svg.clientWidth ? left - away - tip.offsetWidth : left + away}px`;
    tip.style.top = `${Math.max(0, top - away - tip.offsetHeight)}px`;
  };
  hide();
  plot.addEventListener('pointermove', (event) => {
    const box = svg.getBoundingClientRect();
    const scale = svg.viewBox.baseVal.width / box.width;
    const [x, y] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    // Of series at the same place the mean has priority over the cloud, and the curve over its band.
    const rank = { bars: 0, line: 16, points: 36, band: 64 };
    let best = 40 * 40, found = null;
    series.forEach((one, index) => one.rows.forEach(([px, py], row) => {
      const distance = (px - x) ** 2 + (py - y) ** 2 + rank[one.kind];
      if (distance < best) { best = distance; found = [index, row]; }
    }));
    if (found) show(...found); else hide();
  });
  plot.addEventListener('pointerleave', hide);
  plot.addEventListener('blur', hide);
  plot.addEventListener('keydown', (event) => {
    const [index, row] = at;
    const other = (step) => {
      const next = (index + step + series.length) % series.length;
      const x = row < 0 ? 0 : series[index].rows[row][0];
      const near = series[next].rows.reduce((best, one, k, all) => (Math.abs(one[0] - x) < Math.abs(all[best][0] - x) ? k : best), 0);
      show(next, near);
    };
    const along = (target) => show(index, Math.min(Math.max(target, 0), series[index].rows.length - 1));
    const keys = {
      ArrowRight: () => along(row + 1), ArrowLeft: () => along(row - 1), PageUp: () => along(row + 20), PageDown: () => along(row - 20),
      Home: () => along(0), End: () => along(Infinity), ArrowDown: () => other(1), ArrowUp: () => other(-1), Escape: hide,
    };
    if (!series.length || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });

  const csv = () => {
    const lines = shown.series.flatMap((one) => one.rows.map(([, , x, y, z]) => {
      const ends = { band: ['', y, z], bars: [y, y - z, y + z] }[one.kind] || [y, '', ''];
      return [quote(one.name), x, ...ends].join(',');
    }));
    return [['series', csvHead(shown.x), csvHead(shown.y), 'low', 'high'].join(','), ...lines];
  };
  saving(figure, figure.querySelector('figcaption'), drawing, csv);
}
// Paper has no folds: tables of figures go to the end, so that the text stays together.
const folds = [...document.querySelectorAll('details')].map((fold) => ({ fold, home: fold.parentNode, next: fold.nextSibling, open: fold.open }));
const footer = document.querySelector('footer');
addEventListener('beforeprint', () => {
  for (const one of folds) {
    one.open = one.fold.open;
    one.fold.open = true;
    if (one.fold.className === 'data') footer.before(one.fold);
  }
});
addEventListener('afterprint', () => {
  for (const one of folds) {
    one.fold.open = one.open;
    one.home.insertBefore(one.fold, one.next);
  }
});
