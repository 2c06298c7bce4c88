// One controller in full: figures, inputs, errors, and taking it out or in.

import { byId, make, setProperty, setText } from './dom.js';
import { change } from './api.js';
import { ask, onPress, onTwoPresses } from './press.js';
import { hall } from './state.js';
import { mark, healthOf } from './marks.js';
import { makePose, showPose } from './pose.js';
import { ackRate, bits, micros, sentence, whole } from './words.js';

const FIGURES = {
  'Last answer': ({ heard_s: s }) => (s === null ? 'never' : s < 1 ? 'just now' : `${s.toFixed(0)} s ago`),
  'Acks, last second': ({ ack_rate: rate }) => ackRate(rate),
  'Ack latency, median': ({ ack_p50_us: us }) => micros(us),
  'Ack latency, p99': ({ ack_p99_us: us }) => micros(us),
  'Frames sent': ({ sent }) => whole(sent),
  'Acks requested': ({ asked }) => whole(asked),
  'Acked': ({ acked }) => whole(acked),
  'Refused': ({ refused }) => whole(refused),
  'Lost': ({ lost }) => whole(lost),
  'Not sent': ({ send_failed: failed }) => whole(failed),
  'Held back by the limiter': ({ clamps }) => whole(clamps),
  'Knows its position': ({ homed }) => (homed === null ? 'unknown' : homed ? 'yes' : 'no: home it'),
  'Emergency stop': ({ emergency_stop: stop }) => (stop ? 'IN EFFECT' : 'no'),
  'Error': ({ error }) => (error === null ? 'unknown' : error === 0 ? 'none' : `number ${error}`),
  'Drive errors': ({ servo_errors: errors }) => drives(errors),
  'Belts open': ({ belts_open: belts }) => (belts === null ? 'unknown' : belts.length === 0 ? 'none' : belts.map((input) => `X${String(input).padStart(2, '0')}`).join(', ')),
  'Inputs on': ({ inputs }) => bits(inputs, 'X'),
  'Outputs on': ({ outputs }) => bits(outputs, 'Y'),
  'Positions': ({ positions_mm: places, rotary_axis: rotary }) => positions(places, rotary),
};

/** Where axes are, with the unit of each where one of them turns. */
function positions(places, rotary) {
  if (places === null) return 'unknown';
  const unit = (index) => (index + 1 === rotary ? '°' : ' mm');
  const figures = places.map((each) => each.toFixed(1));
  return rotary ? figures.map((each, index) => each + unit(index)).join(', ') : `${figures.join(', ')} mm`;
}

let name = null;
let parts = null;

/** The controller that is looked at; null for none. */
export const selected = () => name;

/** Looks at a controller, or at none. */
export function select(which) {
  const before = name;
  name = which;
  parts = null;
  showController(hall());
  const place = byId('controller');
  if (!place.hidden) {
    place.scrollIntoView({ block: 'nearest' });
    place.focus({ preventScroll: true });
  } else if (before !== null) {
    document.querySelector(`[data-controller="${CSS.escape(before)}"]`)?.focus();
  }
}

/** Shows the controller that is looked at. */
export function showController(status) {
  const place = byId('controller');
  const controller = status?.controllers.find((each) => each.name === name);
  setProperty(place, 'hidden', !controller);
  if (!controller) return;
  if (parts === null) {
    parts = build(controller);
    byId('controller-parts').replaceChildren(...parts.all);
  }
  const health = healthOf(controller);
  setProperty(parts.health, 'className', `health look-${health.look}`);
  if (parts.shape !== health.mark) {
    parts.shape = health.mark;
    parts.picture.replaceChildren(mark(health.mark));
  }
  showPose(parts.pose, controller);
  const forGood = controller.health === 'out';
  setText(parts.word, controller.enabled || forGood ? controller.health : `disabled, ${controller.health}`);
  setText(parts.why, sentence(controller.why));
  for (const [label, figure] of Object.entries(FIGURES)) setText(parts.figures[label], figure(controller));
  setProperty(parts.out, 'hidden', !controller.enabled);
  setProperty(parts.reason, 'hidden', !controller.enabled);
  setProperty(parts.in, 'hidden', controller.enabled || forGood);
}

const takeOut = (button, which, body = {}) => ask(button, `disable ${which}`, () => change('POST', `controllers/${encodeURIComponent(which)}/disable`, body));

/** Has a button that stands apart from its seat disable that, upon a second press. */
export function disable(button, which) {
  onTwoPresses(button, { asks: 'SURE?', label: () => button, action: () => takeOut(button, which) });
  return button;
}

function build({ name: which, row, seat, address, group }) {
  const picture = make('span');
  const word = make('strong');
  const health = make('p', { className: 'health' }, picture, word);
  const why = make('p', { className: 'why' });
  const figures = {};
  const list = make('dl', { className: 'controller-figures' });
  for (const label of Object.keys(FIGURES)) {
    figures[label] = make('dd');
    list.append(make('div', {}, make('dt', {}, label), figures[label]));
  }
  const companions = hall().controllers.filter((each) => each.group === group && each.name !== which).map((each) => each.name);
  const together = companions.length > 0 ? ` with ${companions.join(', ')}` : '';
  const out = make('button', { type: 'button', id: 'controller-disable', className: 'strong' }, `Disable ${which}${together}`);
  const reason = make('input', { type: 'text', id: 'controller-why', maxLength: 200, placeholder: 'reason, for the next operator', 'aria-label': `Reason to disable ${which}` });
  const back = make('button', { type: 'button', id: 'controller-enable', className: 'strong' }, `Enable ${which}${together}`);
  const close = make('button', { type: 'button' }, 'Close');
  onPress(out, (button) => {
    const why = reason.value.trim();
    takeOut(button, which, why ? { why } : {});
    reason.value = '';
  });
  onTwoPresses(back, {
    asks: 'It may move: press again',
    label: () => back,
    action: (button) => ask(button, `enable ${which}`, () => change('POST', `controllers/${encodeURIComponent(which)}/enable`)),
  });
  onPress(close, () => select(null));
  const pose = makePose('large');
  setText(byId('controller-title'), `Seat ${which}${row ? `, row ${row}` : ''}`);
  const where = make('p', { className: 'quiet' }, `seat ${seat}, at ${address}${together ? `, one seat${together}` : ''}`);
  const buttons = make('div', { className: 'row' }, out, reason, back, close);
  return { all: [where, health, why, buttons, pose, list], pose, health, picture, word, why, figures, out, reason, in: back, shape: '' };
}

function drives(errors) {
  if (errors === null) return 'unknown';
  const bad = errors.map((error, drive) => [drive + 1, error]).filter(([, error]) => error !== 0);
  return bad.length === 0 ? 'none' : bad.map(([drive, error]) => `drive ${drive}: ${error}`).join(', ');
}
