// The show's buttons: which may be pressed in which state, and what they ask.

import { byId, setAttribute, setProperty, setText } from './dom.js';
import { change } from './api.js';
import { armNeeds } from './next.js';
import { ask, onPress, onTwoPresses, say } from './press.js';
import { hall } from './state.js';
import { clock } from './words.js';
import { words } from './language.js';
import { stateName, textOf } from './said.js';

const BETWEEN_GOS_MS = 1000;
/** A button that has just changed its meaning is dead for so long: a double tap must not do the opposite. */
const SETTLE_MS = 700;

const MAY = {
  arm: ['parked'],
  disarm: ['armed', 'homing'],
  go: ['armed'],
  pause: ['waiting', 'joining', 'playing', 'holding'],
  resume: ['paused'],
  park: ['recovering', 'parked', 'armed', 'waiting', 'joining', 'playing', 'holding', 'paused'],
  home: ['recovering', 'parked'],
};

const may = (what, state) => MAY[what].includes(state);
/** A show that the other show machine led goes on from `recovering`, once all is known. */
const mayResume = (state, status) => may('resume', state) || (state === 'recovering' && status.next_coded?.code === 'resume');
const post = (what) => change('POST', `show/${what}`);

let lastGo = -Infinity;
let armIs = null;
let armSince = -Infinity;
let relaxGo = () => {};
let relaxGoFrom = () => {};

/** Makes the buttons work. */
export function startTransport() {
  for (const what of ['pause', 'resume', 'park', 'clear']) {
    onPress(byId(what), (button) => ask(button, words(`button.${what}`), () => post(what)));
  }
  onPress(byId('arm'), (button) => {
    if (performance.now() - armSince < SETTLE_MS) return;
    const what = armIs;
    ask(button, words(`button.${what}`), () => post(what)).then((done) => done && what === 'arm' && sayOut(button));
  });
  onTwoPresses(byId('home'), {
    asks: words('home.empty'),
    label: () => byId('home'),
    action: (button) => ask(button, words('button.home'), () => post('home')),
  });
  onTwoPresses(byId('home-arm'), {
    asks: words('home.empty'),
    label: () => byId('home-arm'),
    action: (button) => ask(button, words('button.home-arm'), () => change('POST', 'show/arm', { seats_empty: true })),
  });
  relaxGoFrom = onTwoPresses(byId('go-from'), {
    asks: words('sure'),
    label: () => byId('go-from'),
    action: (button) => {
      const at = left(hall());
      if (at !== null) letGo(button, words('go-from', { at: clock(at) }), () => change('POST', 'show/go', { from_s: at }));
    },
  });
  relaxGo = onTwoPresses(byId('go'), { asks: words('sure'), label: () => byId('go-word'), action: (button) => letGo(button, 'GO', () => post('go')) });
}

/** Where the show was left; null where there is nothing to go on from. */
const left = (status) => status?.show?.resume_s ?? null;

/** Whoever arms hears who is out, since when and why. */
function sayOut(button) {
  const out = (hall()?.warnings ?? []).filter(({ id }) => id === 'seat-out');
  if (out.length > 0) say(button, `${words('press.done', { what: words('button.arm') })}. ${out.map((one) => words('pair', { of: one.controller, text: textOf(one) })).join('; ')}`);
}

function letGo(button, what, request) {
  if (performance.now() - lastGo < BETWEEN_GOS_MS) {
    say(button, words('press.failed', { what, why: words('go.too-soon') }), true);
    return;
  }
  if (!may('go', hall()?.state)) return;
  lastGo = performance.now();
  ask(button, what, request);
}

/** Shows what may be pressed now. */
export function showTransport(status, link) {
  const state = link === 'live' ? status.state : null;
  for (const what of ['pause', 'park', 'go']) setProperty(byId(what), 'disabled', !may(what, state));
  setProperty(byId('resume'), 'disabled', !mayResume(state, status));
  showArm(state, status);
  showGo(state);
  showGoFrom(state, status);
  // What a press would need is in the next action; these two show only where they are one.
  showWhere('home', may('home', status?.state), state !== null);
  showWhere('clear', status?.may_clear ?? false, state !== null);
}

function showWhere(what, wanted, live) {
  setProperty(byId(what), 'hidden', !wanted);
  setProperty(byId(what), 'disabled', !wanted || !live);
}

function showArm(state, status) {
  const homes = status?.arm_homes ?? false;
  const needs = state === 'parked' ? armNeeds(status) : null;
  const button = byId('arm');
  const now = may('disarm', state) ? 'disarm' : 'arm';
  if (now !== armIs) {
    armIs = now;
    armSince = performance.now();
    setText(byId('arm-word'), words(`button.${now}`));
    setAttribute(button, 'data-is', now);
  }
  setProperty(button, 'disabled', !may(now, state) || needs !== null);
  setText(byId('arm-note'), needs ?? '');
  // Where the seats home first a button of its own asks whether they are empty.
  setProperty(button, 'hidden', homes);
  setProperty(byId('home-arm'), 'hidden', !homes);
  setProperty(byId('home-arm'), 'disabled', !may('arm', state));
}

function showGo(state) {
  const live = may('go', state);
  if (!live) relaxGo();
  const sure = byId('go').classList.contains('sure');
  setText(byId('go-note'), sure ? words('go.again') : goNote(state));
}

/** After a stop the place of RESUME is that of a button that begins where the show was left. */
function showGoFrom(state, status) {
  const button = byId('go-from');
  const at = left(status);
  const offered = at !== null && may('go', state);
  setProperty(button, 'hidden', !offered);
  setProperty(byId('resume'), 'hidden', offered);
  if (!offered) {
    relaxGoFrom();
    return;
  }
  button.dataset.word = words('button.go-from', { at: clock(at, 0) });
  if (!button.classList.contains('sure')) setText(button, button.dataset.word);
}

function goNote(state) {
  if (state === null) return words('link.lost');
  if (may('go', state)) return words('go.twice');
  if (may('pause', state)) return words('go.runs');
  return state === 'parked' ? words('go.arm') : words('go.not-while', { state: stateName(state) });
}
