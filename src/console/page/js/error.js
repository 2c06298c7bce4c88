// How far ahead of the film the seats were over the last minute: a curve of the samples that this page received. The scale follows
// the greatest of them, so that half a millisecond is seen where nothing is worse, and says its unit.

import { byId, setAttribute, setProperty, setText } from './dom.js';
import { number, plus } from './words.js';
import { words } from './language.js';

const MINUTE_MS = 60_000;
const HEIGHT = 150;
/** Without a word for so long the line breaks off: what was between is not known. */
const GAP_MS = 1500;
/** Ends of the scale, ms; 40 ms are never slewed but joined. */
const ENDS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const NEUTRAL = '#8d99a8';
const GRID = '#222a33';
const LINE = '#56b4e9';

let samples = [];
let plot = null;
let end = ENDS[0];

/** Takes a sample, ms; null while the seats follow no film. */
export function addError(error, now = performance.now()) {
  const last = samples.at(-1);
  if (last && last.error !== null && now - last.at > GAP_MS) samples.push({ at: last.at + 1, error: null });
  if (error !== null || samples.length > 0) samples.push({ at: now, error });
  samples = samples.filter(({ at }) => now - at <= MINUTE_MS);
  const greatest = greatestOf(samples);
  end = ENDS.find((each) => greatest === null || each >= greatest * 1.05) ?? Math.ceil(greatest * 1.05);
  showWords(error, greatest);
  setProperty(byId('error-curve'), 'hidden', greatest === null);
  if (greatest !== null) drawAll(now);
}

/** Gives the curve the width of its place. */
export const resizeErrors = () => plot?.setSize(size());

/** The greatest deviation of all; null where there was none. */
function greatestOf(all) {
  const known = all.filter(({ error }) => error !== null).map(({ error }) => Math.abs(error));
  return known.length > 0 ? Math.max(...known) : null;
}

function showWords(error, greatest) {
  setText(byId('error-now'), error === null ? '–' : figure(error, true));
  setText(byId('error-greatest'), greatest === null ? '–' : figure(greatest));
  setText(byId('error-scale'), words(greatest === null ? 'error.none' : 'error.scale', { end: number(end) }));
  setAttribute(byId('error-curve'), 'aria-label', words('error.label', { figure: greatest === null ? words('figure.unknown') : figure(greatest) }));
}

/** With two places, so that half a millisecond is told from none. */
function figure(ms, isSigned = false) {
  const rounded = Math.round(ms * 100) / 100 || 0;
  return `${isSigned ? plus(rounded) : ''}${number(rounded, 2)} ms`;
}

const size = () => ({ width: Math.max(byId('error-curve').clientWidth, 200), height: HEIGHT });

function drawAll(now) {
  const data = [samples.map(({ at }) => (at - now) / 1000), samples.map(({ error }) => error)];
  if (plot === null) {
    // The curve only repeats what the figures say: the page works on where it cannot be drawn.
    if (!window.uPlot) return;
    plot = new window.uPlot(options(), data, byId('error-curve'));
  } else plot.setData(data);
}

function options() {
  const axis = { stroke: NEUTRAL, grid: { stroke: GRID, width: 1 }, ticks: { stroke: GRID } };
  return {
    ...size(),
    series: [{}, { stroke: LINE, width: 2, points: { show: false } }],
    legend: { show: false },
    cursor: { show: false },
    scales: { x: { time: false, range: () => [-MINUTE_MS / 1000, 0] }, y: { range: () => [-end, end] } },
    axes: [
      { ...axis, splits: () => [-60, -45, -30, -15, 0], values: (_, all) => all.map((value) => (value === 0 ? words('error.now') : `${number(value)} s`)) },
      { ...axis, size: 74, splits: () => [-end, -end / 2, 0, end / 2, end], values: (_, all) => all.map((value) => `${number(value, Number.isInteger(value) ? 0 : 1)} ms`) },
    ],
  };
}
