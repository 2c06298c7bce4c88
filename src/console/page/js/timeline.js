// The film's bar as a timeline: a lane with its name for each axis, the effects where they are on, the markers; and how much of the
// film is shown, by wheel, by two fingers, or by the keys + and −. A press on it chooses a place, and moves nothing.

import { byId, setProperty, setStyle, setText } from './dom.js';
import { words } from './language.js';
import { onPress } from './press.js';
import { clock } from './words.js';

/** Of a cue so many stretches are drawn: nearer than this they are wider than what they say. */
const NEAREST_S = 10;
const NEAREST_PART = 1 / 40;
const WHEEL = 1.25;
/** Heights, px: of a lane of effects, and the least of an axis whose name can be read. */
const EFFECT = 11;
const NAMED = 9;
/** While part of the film is shown, each axis has its name. */
const TALL = 14;
const MOST_EFFECTS = 2;
/** Names stand beside the line that says where the film is, at its beginning, px. */
const BESIDE = 8;
const EFFECT_COLOUR = '#d9dfe6';
const DARK = '#0a0d11';
const MARKER = '#ffffff';

let axes = [];
let effects = [];
let markers = [];
let length = 1;
let shown = [0, 1];
/** Whether the time that is followed was in it. */
let isIn = true;
const listeners = [];
const fingers = new Map();

/** From when to when the film is shown, s. */
export const view = () => shown;

/** Calls back when more or less of it is shown. */
export const onView = (listener) => listeners.push(listener);

const isWhole = () => shown[1] - shown[0] >= length;

/** Makes wheel, fingers and keys work. */
export function startTimeline() {
  const bar = byId('seek');
  bar.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoom(event.deltaY < 0 ? 1 / WHEEL : WHEEL, placeOf(event.clientX));
  }, { passive: false });
  bar.addEventListener('keydown', (event) => {
    const factor = { '+': 0.5, '=': 0.5, '-': 2, '−': 2, 0: Infinity }[event.key];
    if (factor !== undefined && !event.ctrlKey && !event.metaKey) zoom(factor, Number(bar.value));
  });
  bar.addEventListener('pointerdown', (event) => fingers.set(event.pointerId, event.clientX));
  bar.addEventListener('pointermove', pinch);
  for (const end of ['pointerup', 'pointercancel', 'pointerleave']) bar.addEventListener(end, ({ pointerId }) => fingers.delete(pointerId));
  onPress(byId('whole'), () => zoom(Infinity, 0));
  new ResizeObserver(drawAll).observe(byId('lanes'));
}

function pinch(event) {
  if (!fingers.has(event.pointerId)) return;
  const apart = () => { const [one, other] = fingers.values(); return Math.abs(one - other); };
  const before = fingers.size === 2 ? apart() : 0;
  fingers.set(event.pointerId, event.clientX);
  if (before > 0 && apart() > 0) zoom(before / apart(), placeOf(event.clientX));
}

/** Where in the film a place of the screen is, s. */
function placeOf(x) {
  const { left, width } = byId('lanes').getBoundingClientRect();
  return shown[0] + Math.min(Math.max((x - left) / width, 0), 1) * (shown[1] - shown[0]);
}

/** Shows so many times as much, with what is at a time staying where it is. */
function zoom(factor, about) {
  const before = shown[1] - shown[0];
  isIn = false;
  const span = Math.min(Math.max(before * factor, Math.min(NEAREST_S, length), length * NEAREST_PART), length);
  show(about - ((about - shown[0]) / before) * span, span);
}

/** What is shown goes on with a time that leaves it; of one that was out of it somebody looks elsewhere. */
export function keepInView(at) {
  const wasIn = isIn;
  isIn = at >= shown[0] && at <= shown[1];
  const span = shown[1] - shown[0];
  if (wasIn && !isIn) show(at - span / 4, span);
}

function show(from, span) {
  const first = Math.min(Math.max(from, 0), length - span);
  if (first === shown[0] && first + span === shown[1]) return;
  shown = [first, first + span];
  drawAll();
  for (const listener of listeners) listener();
}

/** Takes what a cue has: the axes from the least to the greatest of each stretch, the effects, and the markers. */
export function setCue(all) {
  ({ axes, effects, markers, length } = all);
  shown = [0, length];
  drawAll();
}

function drawAll() {
  const whole = isWhole();
  setProperty(byId('zoomed'), 'hidden', whole);
  if (!whole) setText(byId('zoomed-words'), words('timeline.shown', { from: clock(shown[0]), to: clock(shown[1]) }));
  setStyle(byId('lanes').parentElement, '--lanes', `${whole ? 0 : axes.length * TALL + MOST_EFFECTS * EFFECT}px`);
  const canvas = byId('lanes');
  const scale = window.devicePixelRatio;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = width * scale;
  canvas.height = height * scale;
  const pen = canvas.getContext('2d');
  pen.scale(scale, scale);
  pen.font = '600 10px system-ui, sans-serif';
  pen.textBaseline = 'middle';
  const stretch = (at) => (length * at) / (axes[0]?.min.length ?? 1);
  const xOf = (at) => ((at - shown[0]) / (shown[1] - shown[0])) * width;
  const blocks = effects.flatMap((effect) => blocksOf(effect, stretch, xOf)).filter(({ from, to }) => to > 0 && from < width);
  const rows = inRows(blocks.sort((a, b) => a.from - b.from), pen);
  const tall = (height - rows.length * EFFECT) / axes.length;
  for (const [index, axis] of axes.entries()) drawAxis(pen, axis, { top: index * tall, tall, width });
  for (const [index, row] of rows.entries()) drawRow(pen, row, height - (rows.length - index) * EFFECT);
  drawMarkers(pen, xOf, height);
}

/** Each stretch of time in which an effect is on. */
function blocksOf({ name, on }, stretch, xOf) {
  const blocks = [];
  for (let at = 0; at < on.length; at += 1) {
    if (!on[at]) continue;
    const first = at;
    while (at + 1 < on.length && on[at + 1]) at += 1;
    blocks.push({ name, from: xOf(stretch(first)), to: xOf(stretch(at + 1)) });
  }
  return blocks;
}

/** Lays blocks into few rows, with room for their names where there is any. */
function inRows(blocks, pen) {
  const rows = [];
  for (const block of blocks) {
    const wide = pen.measureText(block.name).width + 6;
    let row = rows.find((one) => one.end <= block.from);
    if (!row && rows.length < MOST_EFFECTS) rows.push(row = { end: 0, blocks: [] });
    row ??= rows.reduce((least, one) => (one.end < least.end ? one : least));
    row.blocks.push({ ...block, wide });
    row.end = Math.max(row.end, block.to - block.from >= wide ? block.to : block.to + wide);
  }
  return rows;
}

function drawRow(pen, { blocks }, top) {
  for (const [index, { name, from, to, wide }] of blocks.entries()) {
    pen.fillStyle = EFFECT_COLOUR;
    pen.fillRect(from, top + 1, Math.max(to - from, 1), EFFECT - 2);
    const inside = to - from >= wide;
    // A name that the next block would cover is not begun.
    if (!inside && to + wide > (blocks[index + 1]?.from ?? Infinity)) continue;
    pen.fillStyle = inside ? DARK : EFFECT_COLOUR;
    pen.fillText(name, (inside ? Math.max(from, 0) : to) + 3, top + EFFECT / 2 + 0.5);
  }
}

function drawAxis(pen, { name, colour, min, max }, { top, tall, width }) {
  pen.fillStyle = colour;
  const part = (shown[1] - shown[0]) / length / width;
  for (let x = 0; x < width; x += 1) {
    const at = Math.min(Math.floor((shown[0] / length + x * part) * min.length), min.length - 1);
    const [low, high] = [min[at], max[at]].map((of) => top + (0.92 - 0.84 * of) * tall);
    pen.fillRect(x, high, 1, Math.max(low - high, 1));
  }
  if (tall < NAMED) return;
  const wide = pen.measureText(name).width + 6;
  pen.fillStyle = DARK;
  pen.fillRect(BESIDE, top, wide, tall);
  pen.fillStyle = colour;
  pen.fillText(name, BESIDE + 3, top + tall / 2 + 0.5);
}

function drawMarkers(pen, xOf, height) {
  pen.fillStyle = MARKER;
  for (const { at_s: at, name } of markers) {
    pen.fillRect(xOf(at), 0, 1, height / 3);
    if (!isWhole()) pen.fillText(name, xOf(at) + 3, 7);
  }
}
