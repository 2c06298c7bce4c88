// The curves of the loaded cue, each axis as the band between the least and the greatest value of each stretch of time, with
// the playhead on top.

import { byId, choice, make, setProperty, setText } from './dom.js';
import { get } from './api.js';
import { setCue } from './timeline.js';
import { drawTrace, keepTrace, tracedSeat } from './trace.js';
import { clock } from './words.js';
import { words } from './language.js';

const POINTS = 1500;
const HEIGHT = 240;
const AGAIN_MS = 5000;
const REDRAW_MS = 1000;
const NEUTRAL = '#8d99a8';
const GRID = '#222a33';
/** Told apart by the colour-blind, and none of them red, which is STOP's; from the seventh axis on dashed. */
const COLOURS = ['#56b4e9', '#eedd88', '#d58ab5', '#2fbf91', '#e69f00', '#d9dfe6'];

let drawn = null;
let plot = null;
let playhead = null;
let span = 0;
let length = 0;
let failed = null;

/** Makes the choice of the span work, and keeps the plot as wide as its place. */
export function startCurves() {
  choice(byId('curves-span'), (data) => {
    span = Number(data.span);
    failed = null;
    drawn === null || place(lastPosition);
  });
  new ResizeObserver(() => plot?.setSize(size())).observe(byId('curves'));
}

let lastPosition = 0;

/** Shows the curves of what is loaded, read when it changes, and the playhead. */
export function showCurves(status) {
  const show = status?.show ?? null;
  const wanted = show && `${show.cue} ${show.sha256}`;
  if (wanted !== drawn && !(failed && failed.wanted === wanted && performance.now() - failed.at < AGAIN_MS)) {
    drawn = wanted;
    clearPlot();
    if (show) read(show, wanted);
    else setText(byId('curves-note'), words('curves.none'));
  }
  if (!show) return;
  lastPosition = show.position_s;
  keepTrace(status);
  showTrace();
  place(show.position_s);
}

function clearPlot() {
  plot?.destroy();
  plot = null;
  setCue({ axes: [], effects: [], markers: [], length: 1 });
  byId('curves').replaceChildren();
}

async function read(show, wanted) {
  setText(byId('curves-note'), words('curves.reading'));
  try {
    const curve = await get(`cues/${encodeURIComponent(show.cue)}/curve?points=${POINTS}`);
    if (drawn !== wanted) return;
    build(curve);
    setText(byId('curves-note'), '');
  } catch (error) {
    if (drawn !== wanted) return;
    failed = { wanted, at: performance.now() };
    drawn = null;
    setText(byId('curves-note'), words('curves.failed', { why: error.words ?? error.message }));
  }
}

let redrawn = 0;

/** Draws the points of the seat that is looked at, once a second: they grow, the curves do not. */
function showTrace() {
  const seat = tracedSeat();
  if (plot && (seat !== traced || (seat !== null && performance.now() - redrawn > REDRAW_MS))) {
    traced = seat;
    redrawn = performance.now();
    setText(byId('curves-note'), seat === null ? '' : words('curves.points', { seat }));
    plot.redraw(false, false);
  }
}

let traced = null;

const size = () => ({ width: Math.max(byId('curves').clientWidth, 200), height: HEIGHT });

function build(curve) {
  clearPlot();
  length = curve.length_s;
  const axes = curve.axes.map((axis, index) => ({ ...axis, colour: COLOURS[index % COLOURS.length] }));
  setCue({ axes, effects: curve.effects, markers: curve.markers, length });
  const { series, bands, data } = linesOf(curve);
  const axis = { stroke: NEUTRAL, grid: { stroke: GRID, width: 1 }, ticks: { stroke: GRID } };
  const options = {
    ...size(),
    series,
    bands,
    legend: { show: false },
    hooks: { draw: [(drawn) => drawTrace(drawn, COLOURS)] },
    cursor: { show: false },
    scales: { x: { time: false, range: () => window_() } },
    axes: [
      { ...axis, values: (_, values) => values.map((value) => clock(value, Number.isInteger(value) ? 0 : 1)) },
      { ...axis, size: 50 },
    ],
  };
  // The curves only repeat what the figures say: the page works on where they cannot be drawn.
  plot = new window.uPlot(options, data, byId('curves'));
  playhead = make('div', { className: 'playhead' });
  plot.over.append(playhead);
  byId('curves').append(keyOf(curve));
  place(lastPosition);
}

function linesOf(curve) {
  const series = [{}];
  const bands = [];
  const data = [curve.t_s];
  for (const [index, { name, min, max }] of curve.axes.entries()) {
    const colour = COLOURS[index % COLOURS.length];
    const line = { label: name, stroke: colour, width: 1.5, points: { show: false }, dash: index >= COLOURS.length ? [6, 4] : undefined };
    series.push(line, line);
    data.push(max, min);
    bands.push({ series: [2 * index + 1, 2 * index + 2], fill: `${colour}55` });
  }
  return { series, bands, data };
}

function keyOf(curve) {
  const entries = curve.axes.map(({ name }, index) => {
    const swatch = make('span', { className: `swatch${index >= COLOURS.length ? ' dashed' : ''}`, 'aria-hidden': 'true' });
    swatch.style.setProperty('--colour', COLOURS[index % COLOURS.length]);
    return make('li', {}, swatch, name);
  });
  return make('ul', { className: 'curves-key' }, ...entries);
}

let shown = [0, 1];

/** The stretch of time that is shown: all of it, or so much around the playhead. */
function window_() {
  if (span === 0 || span >= length) shown = [0, length];
  else {
    const from = Math.min(Math.max(lastPosition - span / 4, 0), length - span);
    shown = [from, from + span];
  }
  return shown;
}

function place(position) {
  if (!plot) return;
  const [from, to] = shown;
  const outside = position < from || position > from + (to - from) * 0.75;
  const wanted = span === 0 || span >= length ? length : span;
  if (Math.abs(to - from - wanted) > 1e-6 || (wanted < length && outside && to < length) || (wanted < length && position < from)) {
    const [min, max] = window_();
    plot.setScale('x', { min, max });
  }
  const inside = position >= shown[0] && position <= shown[1];
  setProperty(playhead, 'hidden', !inside);
  if (inside) playhead.style.setProperty('--at', `${plot.valToPos(position, 'x')}px`);
}
