// The hall as a map: a line for each row, a field for each controller, coloured and marked by how it stands.

import { byId, choice, make, setAttribute, setProperty, setStyle, setText } from './dom.js';
import { BANDS, HEALTH, ackBand, latencyBand, mark, healthOf } from './marks.js';
import { ackRate, micros } from './words.js';
import { hall } from './state.js';
import { selected, select } from './controller.js';
import { makePose, showPose } from './pose.js';

const NO_ROW = 'no row';
/** Names of rows up to so long stand beside their seats, longer ones above them; longer names of seats need wider fields. */
const SHORT_ROW = 2;
const SHORT_SEAT = 6;
let by = 'health';
let drawn = '';
let fields = new Map();

/** Makes the choice of colours work. */
export function startMap() {
  choice(byId('map-by'), (data) => {
    by = data.by;
    showLegend();
    if (hall()) showMap(hall());
  });
  showLegend();
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
  const rows = new Map();
  for (const controller of controllers) {
    const row = controller.row ?? NO_ROW;
    if (!rows.has(row)) rows.set(row, []);
    rows.get(row).push(makeField(controller));
  }
  const widest = Math.max(...[...rows.values()].map((seats) => seats.length));
  setStyle(byId('map'), '--widest', String(widest));
  const lines = [...rows].map(([row, seats]) => {
    const title = row === NO_ROW ? '' : row;
    const isWide = seats.some((seat) => seat.dataset.controller.length > SHORT_SEAT);
    const line = make('div', { className: isWide ? 'seats wide-names' : 'seats', role: 'group', 'aria-label': row === NO_ROW ? 'Seats without a row' : `Row ${row}` });
    line.append(...seats);
    return make('div', { className: title.length > SHORT_ROW ? 'map-row long' : 'map-row' }, make('span', { className: 'row-name', 'aria-hidden': 'true' }, title), line);
  });
  byId('map').replaceChildren(...lines);
}

function makeField({ name }) {
  const picture = make('span', { className: 'picture' });
  const letters = make('span', { className: 'letters' });
  const pose = makePose('small');
  const figure = make('span', { className: 'field-figure' });
  const button = make('button', { type: 'button', className: 'field' },
    make('span', { className: 'field-head' }, picture, letters, pose),
    make('span', { className: 'field-name' }, name), figure);
  button.dataset.controller = name;
  button.addEventListener('click', () => select(selected() === name ? null : name));
  fields.set(name, { button, picture, letters, pose, figure, shape: '' });
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
  setText(field.letters, look.letters);
  showPose(field.pose, controller);
  setText(field.figure, by === 'latency' ? micros(controller.ack_p99_us, 2) : ackRate(controller.ack_rate));
  setAttribute(field.button, 'aria-label', spoken(controller));
  setProperty(field.button, 'title', controller.why);
}

function lookOf(controller) {
  const health = healthOf(controller);
  // A controller that takes no part has no figures worth a colour.
  if (by === 'health' || ['away', 'bad', 'held'].includes(health.look)) return health;
  return by === 'acks' ? ackBand(controller.ack_rate) : latencyBand(controller.ack_p99_us);
}

function spoken({ name, row, enabled, health, ack_rate: acks, ack_p99_us: p99 }) {
  const place = row ? `, row ${row}` : '';
  return `${name}${place}: ${enabled ? health : health === 'out' ? 'disabled in the configuration' : 'disabled'}, acks ${ackRate(acks)}, latency ${micros(p99)}`;
}

function showLegend() {
  const entry = (look, text) => make('li', { className: `look-${look.look}` }, mark(look.mark), make('b', {}, look.letters), ` ${text}`);
  const bands = {
    acks: ['99.5 % or more acked', '95 % or more', 'less', 'no acks requested'],
    latency: ['p99 up to 2 ms', 'up to 10 ms', 'longer', 'no acks'],
  }[by];
  const entries = bands
    ? Object.values(BANDS).map((look, index) => entry(look, bands[index]))
    : Object.entries(HEALTH).map(([name, look]) => entry(look, `${name}: ${look.means}`));
  byId('legend').replaceChildren(...entries);
}
