// One controller in full: figures, inputs, errors, and taking it out or in.

import { byId, make, setProperty, setText } from './dom.js';
import { change } from './api.js';
import { ask, onPress, onTwoPresses, say } from './press.js';
import { hall } from './state.js';
import { healthOf, mark } from './marks.js';
import { makePose, showPose } from './pose.js';
import { ackRate, bits, lasting, micros, number, sentence, whole } from './words.js';
import { said, words } from './language.js';
import { healthName, textOf } from './said.js';

const FIGURES = {
  'figure.heard': ({ heard_s: s }) => (s === null ? words('figure.never') : s < 1 ? words('figure.just-now') : words('figure.ago', { time: lasting(s) })),
  'figure.ack-rate': ({ ack_rate: rate }) => ackRate(rate),
  'figure.ack-median': ({ ack_p50_us: us }) => micros(us),
  'figure.ack-p99': ({ ack_p99_us: us }) => micros(us),
  'figure.sent': ({ sent }) => whole(sent),
  'figure.asked': ({ asked }) => whole(asked),
  'figure.acked': ({ acked }) => whole(acked),
  'figure.refused': ({ refused }) => whole(refused),
  'figure.lost': ({ lost }) => whole(lost),
  'figure.not-sent': ({ send_failed: failed }) => whole(failed),
  'figure.clamps': ({ clamps }) => whole(clamps),
  'figure.homed': ({ homed }) => words(homed === null ? 'figure.unknown' : homed ? 'figure.yes' : 'figure.not-homed'),
  'figure.emergency-stop': ({ emergency_stop: stop }) => words(stop ? 'figure.in-effect' : 'figure.no'),
  'figure.error': ({ error }) => (error === null ? words('figure.unknown') : error === 0 ? words('figure.none') : words('figure.number', { n: error })),
  'figure.drive-errors': ({ servo_errors: errors }) => drives(errors),
  'figure.belts': ({ belts_open: belts }) => belted(belts),
  'figure.inputs': ({ inputs }) => bits(inputs, 'X'),
  'figure.outputs': ({ outputs }) => bits(outputs, 'Y'),
  'figure.left-on': ({ left_on: on }) => words(on ? 'figure.maybe' : 'figure.no'),
  'figure.positions': ({ positions_mm: places, rotary_axis: rotary }) => positions(places, rotary),
};

function belted(belts) {
  if (belts === null) return words('figure.unknown');
  return belts.length === 0 ? words('figure.none') : belts.map((input) => `X${String(input).padStart(2, '0')}`).join(', ');
}

/** Where axes are, with the unit of each where one of them turns. */
function positions(places, rotary) {
  if (places === null) return words('figure.unknown');
  const unit = (index) => (index + 1 === rotary ? '°' : ' mm');
  const figures = places.map((each) => number(each, 1));
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
    place.scrollIntoView();
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
  const word = healthName(controller.health);
  setText(parts.word, controller.enabled || forGood ? word : `${healthName('disabled')}, ${word}`);
  setText(parts.why, sentence(whyOf(controller, status.warnings)));
  for (const [label, figure] of Object.entries(FIGURES)) setText(parts.figures[label], figure(controller));
  setProperty(parts.out, 'hidden', !controller.enabled);
  setProperty(parts.reason, 'hidden', !controller.enabled);
  setProperty(parts.in, 'hidden', controller.enabled || forGood);
}

/** Why it stands so; of one that a person took out, since when, who and why. */
function whyOf({ name: which, why, why_coded: coded }, warnings) {
  const known = said('standing', coded ?? {}, null);
  if (known === null) return why;
  const out = warnings.find(({ id, controller }) => id === 'seat-out' && controller === which);
  return out ? `${textOf(out)}; ${known}` : known;
}

const takeOut = (button, which, body = {}) => ask(button, words('seat.disable', { which }), () => change('POST', `controllers/${encodeURIComponent(which)}/disable`, body));

/** Has a button that stands apart from its seat disable that, upon a second press. */
export function disable(button, which) {
  onTwoPresses(button, { asks: words('sure'), label: () => button, action: () => takeOut(button, which) });
  return button;
}

/** The same for several: one button, one after the other. */
export function disableAll(button, names) {
  const action = async () => {
    const all = { n: names.length };
    let done = 0;
    const each = async () => {
      for (const name of names) {
        await change('POST', `controllers/${encodeURIComponent(name)}/disable`);
        done += 1;
      }
    };
    await ask(button, words('seat.disable-all', all), each, { long: true });
    if (done < names.length) say(button, words('seat.disabled-of', { ...all, done }), true);
  };
  onTwoPresses(button, { asks: words('sure'), label: () => button, action });
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
    list.append(make('div', {}, make('dt', {}, words(label)), figures[label]));
  }
  const companions = hall().controllers.filter((each) => each.group === group && each.name !== which).map((each) => each.name);
  const together = companions.length > 0 ? words('seat.with', { others: companions.join(', ') }) : '';
  const out = make('button', { type: 'button', id: 'controller-disable', className: 'strong' }, words('seat.disable', { which: which + together }));
  const reason = make('input', { type: 'text', id: 'controller-why', maxLength: 200, placeholder: words('seat.reason'), 'aria-label': words('seat.reason-of', { which }) });
  const back = make('button', { type: 'button', id: 'controller-enable', className: 'strong' }, words('seat.enable', { which: which + together }));
  const close = make('button', { type: 'button' }, words('close'));
  onPress(out, (button) => {
    const why = reason.value.trim();
    takeOut(button, which, why ? { why } : {});
    reason.value = '';
  });
  onTwoPresses(back, {
    asks: words('seat.may-move'),
    label: () => back,
    action: (button) => ask(button, words('seat.enable', { which }), () => change('POST', `controllers/${encodeURIComponent(which)}/enable`)),
  });
  onPress(close, () => select(null));
  const pose = makePose('large');
  setText(byId('controller-title'), row ? words('seat.title-row', { which, row }) : words('seat.title', { which }));
  const where = make('p', { className: 'quiet' }, words('seat.where', { seat, address }) + (together ? `, ${words('seat.one')}${together}` : ''));
  const buttons = make('div', { className: 'row' }, out, reason, back, close);
  return { all: [where, health, why, buttons, pose, list], pose, health, picture, word, why, figures, out, reason, in: back, shape: '' };
}

function drives(errors) {
  if (errors === null) return words('figure.unknown');
  const bad = errors.map((error, drive) => [drive + 1, error]).filter(([, error]) => error !== 0);
  return bad.length === 0 ? words('figure.none') : bad.map(([drive, error]) => words('figure.drive', { drive, error })).join(', ');
}
