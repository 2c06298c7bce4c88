'use strict';
// Shows a part of the picture larger: what is drawn is stretched, what has a time of its own is put where that is.
const steps = [.001, .002, .005, .01, .02, .05, .1, .2, .5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400];
const main = document.querySelector('main');
const from = Number(main.dataset.from), length = Number(main.dataset.until) - from, columns = Number(main.dataset.columns);
// Stretches of the film beside each other: where on the axis each begins, and the show times of its ends.
const passes = JSON.parse(main.dataset.passes ?? `[[${from},${from},${from + length}]]`);
const longest = Math.max(...passes.map(([, first, last]) => last - first));
let view = [0, 1];

const clock = (at, step) => {
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), units = Math.round(at * 10 ** places), whole = Math.floor(units / 10 ** places);
  const two = (n) => String(n).padStart(2, '0');
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const part = places ? `.${String(units % 10 ** places).padStart(places, '0')}` : '';
  return `${h ? `${two(h)}:` : ''}${two(m)}:${two(s)}${part}`;
};

function ticks() {
  const [begin, end] = view.map((part) => from + part * length);
  const most = Math.max(2, document.querySelector('.times').clientWidth / 90);
  // Steps are at most 2.5 times apart, so that the longest pass has a tick.
  const least = passes.length > 1 ? Math.min((end - begin) / most, longest / 2.5) : (end - begin) / most;
  const step = steps.find((one) => one >= least) ?? 28800;
  const places = [];
  for (const [at, first, last] of passes) {
    // Ticks of passes that follow each other may come too close.
    for (let n = Math.ceil(Math.max(first, first + begin - at) / step - 1e-9); n * step <= Math.min(last, first + end - at) + 1e-9; n++) {
      const place = at + n * step - first;
      if (places.length === 0 || place - places.at(-1)[0] >= .8 * (end - begin) / most) places.push([place, n * step]);
    }
  }
  for (const box of document.querySelectorAll('.ticks')) {
    const all = places.map(([place, film]) => {
      const tick = document.createElement('i');
      tick.className = 'tick';
      tick.dataset.at = (place - from) / length;
      if (box.classList.contains('times')) tick.append(Object.assign(document.createElement('span'), { textContent: clock(film, step) }));
      return tick;
    });
    box.classList.add('fitted'); // as many as there is room for: none has to give way
    box.replaceChildren(...all);
  }
}

const GAP = 6; // px between two names, which else read as one
// Flags with their names, and how these stand on paper.
const flags = [...document.querySelectorAll('.flags .flag')].map((flag) => ({ flag, name: flag.firstChild, paper: [flag.className, flag.firstChild.hidden, flag.firstChild.style.top] }));

/** Puts the names of flags into rows in which they do not run into each other; what a person has marked comes first. */
function names() {
  const box = document.querySelector('.flags'), shown = flags.filter(({ flag }) => !flag.hidden);
  if (shown.length === 0) return;
  box.classList.add('fitted');
  const length = box.clientWidth, { left, right } = box.getBoundingClientRect(), rows = [[], [], [], []];
  for (const one of shown) {
    one.at = parseFloat(one.flag.style.left) / 100 * length;
    one.before = one.at > .6 * length;
    one.flag.classList.toggle('late', one.before);
    one.name.hidden = false;
    one.name.style.maxWidth = `min(22em, ${(one.before ? left + one.at : innerWidth - right + length - one.at) - 4}px)`;
  }
  for (const one of shown) one.width = one.name.offsetWidth;
  for (const { name, at, before, width } of [...shown].sort((a, b) => b.flag.classList.contains('marked') - a.flag.classList.contains('marked'))) {
    const begin = before ? at - width : at;
    const row = rows.findIndex((taken) => taken.every(([from, to]) => to + GAP <= begin || begin + width + GAP <= from));
    name.hidden = row < 0;
    if (row < 0) continue;
    rows[row].push([begin, begin + width]);
    name.style.top = `${20 * row}px`;
  }
}

function draw() {
  const [begin, end] = view;
  ticks();
  for (const svg of document.querySelectorAll('.clip svg')) svg.setAttribute('viewBox', `${begin * columns} 0 ${(end - begin) * columns} ${svg.dataset.high}`);
  for (const one of document.querySelectorAll('[data-at]')) {
    const at = (Number(one.dataset.at) - begin) / (end - begin);
    one.hidden = at < -1e-9 || at > 1 + 1e-9;
    one.style.left = `${100 * at}%`;
  }
  names();
}

/** Shows the part between two places, never less than eight columns of it. */
function show(begin, end) {
  const span = Math.min(1, Math.max(end - begin, 8 / columns));
  const first = Math.min(Math.max((begin + end - span) / 2, 0), 1 - span);
  view = [first, first + span];
  draw();
}

const move = (by) => show(view[0] + by * (view[1] - view[0]), view[1] + by * (view[1] - view[0]));
const zoom = (by, about = .5) => {
  const span = view[1] - view[0], at = view[0] + about * span;
  show(at - by * about * span, at + by * (1 - about) * span);
};
const does = { in: () => zoom(.5), out: () => zoom(2), back: () => move(-.5), on: () => move(.5), whole: () => show(0, 1) };
for (const button of document.querySelectorAll('.tools button')) button.addEventListener('click', does[button.dataset.does]);
document.querySelector('.tools').hidden = false;

for (const box of document.querySelectorAll('.drag')) {
  const part = (event) => {
    const { left, width } = box.getBoundingClientRect();
    return Math.min(Math.max((event.clientX - left) / width, 0), 1);
  };
  let start = null;
  const chosen = Object.assign(document.createElement('div'), { className: 'chosen', hidden: true });
  box.append(chosen);
  box.addEventListener('pointerdown', (event) => { start = part(event); box.setPointerCapture(event.pointerId); });
  box.addEventListener('pointermove', (event) => {
    if (start === null) return;
    const [low, high] = [start, part(event)].sort((a, b) => a - b);
    Object.assign(chosen.style, { left: `${100 * low}%`, width: `${100 * (high - low)}%` });
    chosen.hidden = false;
  });
  box.addEventListener('pointerup', (event) => {
    const [low, high] = [start, part(event)].sort((a, b) => a - b), span = view[1] - view[0];
    start = null;
    chosen.hidden = true;
    if (high - low > .01) show(view[0] + low * span, view[0] + high * span);
  });
  box.addEventListener('pointercancel', () => { start = null; chosen.hidden = true; });
  box.addEventListener('dblclick', does.whole);
  box.addEventListener('wheel', (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    zoom(event.deltaY > 0 ? 1.25 : .8, part(event));
  }, { passive: false });
}
addEventListener('resize', draw);
addEventListener('beforeprint', () => {
  for (const { flag, name, paper } of flags) {
    [flag.className, name.hidden, name.style.top] = paper;
    name.style.maxWidth = '';
  }
});
addEventListener('afterprint', draw);
draw();
