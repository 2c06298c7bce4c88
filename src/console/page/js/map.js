// The hall as a map: a line for each row, a field for each controller, coloured and marked by how it stands.

import { byId, choice, make, setAttribute, setProperty, setStyle, setText } from './dom.js';
import { BANDS, HEALTH, ackBand, healthOf, healthWord, latencyBand, mark } from './marks.js';
import { ackRate, micros, percent } from './words.js';
import { hall } from './state.js';
import { selected, select } from './controller.js';
import { makePose, showPose } from './pose.js';
import { said, words } from './language.js';
import { healthName } from './said.js';

const NO_ROW = '';
/** Names of rows up to so long stand beside their seats, longer ones above them; longer names of seats need wider fields. */
const SHORT_ROW = 2;
const SHORT_SEAT = 6;
/** How tall a line of fields is, and how much of the window they may take. */
const LINE_PX = 52;
const MOST_OF_HEIGHT = 0.6;
let by = 'health';
let drawn = '';
let fields = new Map();
/** The fields as they lie, row by row: one is the tab stop of all, the arrow keys lead on. */
let rows = [];

/** Makes the choice of colours and the keys work. */
export function startMap() {
  byId('map').addEventListener('keydown', onKey);
  choice(byId('map-by'), (data) => {
    by = data.by;
    showLegend();
    if (hall()) showMap(hall());
  });
  showLegend();
  new ResizeObserver(fit).observe(byId('map'));
  addEventListener('resize', fit);
}

/** Fields are as large as a finger where they all have room in most of the height; else each is a mark. */
function fit() {
  const perLine = Math.max(Math.floor(byId('map').clientWidth / (innerWidth > 700 ? 59 : 78)), 1);
  const lines = rows.reduce((sum, seats) => sum + Math.ceil(seats.length / perLine), 0);
  byId('map').classList.toggle('compact', lines * LINE_PX > innerHeight * MOST_OF_HEIGHT);
}

/** Shows every controller. */
export function showMap(status) {
  if (!status) return;
  const places = status.controllers.map(({ name, row, group }) => `${row}/${name}/${group}`).join('|');
  if (places !== drawn) {
    drawn = places;
    layOut(status.controllers);
  }
  for (const controller of status.controllers) showField(fields.get(controller.name), controller);
}

function layOut(controllers) {
  fields = new Map();
  const named = new Map();
  for (const controller of controllers) {
    const row = controller.row ?? NO_ROW;
    if (!named.has(row)) named.set(row, []);
    named.get(row).push(makeField(controller));
  }
  rows = [...named.values()];
  if (rows.length > 0) rows[0][0].tabIndex = 0;
  const widest = Math.max(...rows.map((seats) => seats.length));
  setStyle(byId('map'), '--widest', String(widest));
  const lines = [...named].map(([row, seats]) => {
    const isWide = seats.some((seat) => seat.dataset.controller.length > SHORT_SEAT);
    const line = make('div', { className: isWide ? 'seats wide-names' : 'seats', role: 'group', 'aria-label': row === NO_ROW ? words('map.no-row') : words('row', { row }) });
    line.append(...seats);
    return make('div', { className: row.length > SHORT_ROW ? 'map-row long' : 'map-row' }, make('span', { className: 'row-name', 'aria-hidden': 'true' }, row), line);
  });
  byId('map').replaceChildren(...lines);
  fit();
}

function makeField({ name }) {
  const picture = make('span', { className: 'picture' });
  const pose = makePose('small');
  const figure = make('span', { className: 'field-figure' });
  const button = make('button', { type: 'button', className: 'field', tabIndex: -1 },
    make('span', { className: 'field-head' }, picture, make('span', { className: 'field-name' }, name), pose), figure);
  button.dataset.controller = name;
  button.addEventListener('focus', () => moveStop(button));
  button.addEventListener('click', () => select(selected() === name ? null : name));
  fields.set(name, { button, picture, pose, figure, shape: '' });
  return button;
}

function showField(field, controller) {
  const look = lookOf(controller);
  setProperty(field.button, 'className', `field look-${look.look}${controller.enabled ? '' : ' disabled-seat'}`);
  setAttribute(field.button, 'aria-pressed', String(selected() === controller.name));
  if (field.shape !== look.mark) {
    field.shape = look.mark;
    field.picture.replaceChildren(mark(look.mark));
  }
  showPose(field.pose, controller);
  setText(field.figure, look.figure ?? healthName(healthWord(controller)));
  setAttribute(field.button, 'aria-label', spoken(controller));
  setProperty(field.button, 'title', said('standing', controller.why_coded ?? {}, controller.why));
}

function lookOf(controller) {
  const health = healthOf(controller);
  // A controller that takes no part has no figures worth a colour.
  if (by === 'health' || ['away', 'bad', 'fault', 'held', 'homeless'].includes(health.look)) return health;
  const { ack_rate: rate, ack_p99_us: p99 } = controller;
  return by === 'acks' ? { ...ackBand(rate), figure: words('map.acks-figure', { rate: ackRate(rate) }) } : { ...latencyBand(p99), figure: `p99 ${micros(p99, 2)}` };
}

function spoken(controller) {
  const { name, row, ack_rate: acks, ack_p99_us: p99 } = controller;
  const place = row ? `${name}, ${words('row', { row })}` : name;
  return words('map.spoken', { place, health: healthName(healthWord(controller)), acks: ackRate(acks), latency: micros(p99) });
}

function showLegend() {
  const entry = (look, text) => make('li', { className: `look-${look.look}` }, mark(look.mark), ` ${text}`);
  const entries = by === 'health'
    ? Object.entries(HEALTH).map(([name, look]) => entry(look, words('pair', { of: healthName(name), text: words(`means.${name}`) })))
    : Object.entries(BANDS).map(([band, look]) => entry(look, words(`band.${by}.${band}`, { good: percent(0.995, 1), weak: percent(0.95) })));
  byId('legend').replaceChildren(...entries);
}

/** Left and right along the hall, up and down to the nearest seat of the next row, Home and End to the ends of a row. */
function onKey(event) {
  const row = rows.findIndex((seats) => seats.includes(document.activeElement));
  if (row < 0) return;
  const seat = rows[row].indexOf(document.activeElement);
  const all = rows.flat();
  const at = all.indexOf(document.activeElement);
  const beside = (seats) => seats?.[Math.min(seat, seats.length - 1)];
  const next = {
    ArrowRight: all[at + 1], ArrowLeft: all[at - 1], ArrowDown: beside(rows[row + 1]), ArrowUp: beside(rows[row - 1]),
    Home: rows[row][0], End: rows[row].at(-1),
  };
  if (!(event.key in next)) return;
  event.preventDefault();
  next[event.key]?.focus();
}

function moveStop(button) {
  for (const each of rows.flat()) setProperty(each, 'tabIndex', each === button ? 0 : -1);
}
