// What a person does next, as a button where the page can do it: one beside the words, or the marked one of the show's buttons.

import { byId, make, onChange, setAttribute, setProperty } from './dom.js';
import { disable, disableAll } from './controller.js';
import { isShut } from './lock.js';
import { healthWord } from './marks.js';
import { chosenCue, loadCue } from './playlist.js';
import { isAllSilent, isOut, worstOf } from './seats.js';
import { onPress } from './press.js';
import { runPreflight } from './reports.js';
import { words } from './language.js';

/** Seats that are offered to be disabled; of more the map and the warnings are the place. */
const OFFERED = 2;
const SILENT = ['lost', 'unknown', 'error'];
/** The button of the show that does what the hall says is next. */
const PRESSED = {
  'park-first': 'park',
  'park-or-home': 'park', 'park-or-start': 'park', home: 'home', arm: 'arm', 'arm-or-from': 'arm', 'arm-and-home': 'home-arm', go: 'go', 'go-or-from': 'go',
  resume: 'resume', 'let-join': 'resume', clear: 'clear', restart: 'clear', 'check-cue': 'clear', 'look-at-seat': 'clear', 'stop-other-master': 'clear',
};

/** What arming still waits for; null where it waits for nothing. */
export function armNeeds({ show, preflight }) {
  if (!show) return words('arm.load');
  return preflight?.passed ? null : words('arm.preflight');
}

/** Shows both. */
export function showNext(status, link) {
  const live = link === 'live';
  showActions(live ? actionsOf(status) : []);
  // Where seats are out they come first; one that stands up is brought down before.
  const worst = live ? worstOf(status) : null;
  const next = (live && (worst === null || worst.away) && PRESSED[status.next_coded?.code]) || null;
  const shut = next !== null && isShut(byId(next));
  setProperty(byId('next-locked'), 'hidden', !shut);
  for (const button of document.querySelectorAll('.transport button, #lock')) setAttribute(button, 'data-next', String(button.id === (shut ? 'lock' : next)));
}

function actionsOf(status) {
  const { state, show, preflight, may_clear: mayClear } = status;
  if (state === 'boot' || (state === 'parked' && worstOf(status)?.names.length > 0)) return inTheWay(status);
  if (state !== 'parked' || mayClear || worstOf(status)?.away) return [];
  if (!show) return [{ what: 'load', of: chosenCue() }];
  return preflight?.passed ? [] : [{ what: 'preflight' }, ...(preflight ? inTheWay(status) : [])];
}

/** Who does not answer, or failed preflight; all at once where they have one cause. */
function inTheWay(status) {
  const { controllers, preflight } = status;
  if (isAllSilent(status)) return [{ what: 'disable-all', of: controllers.filter(isOut).map(({ name }) => name) }];
  const failed = (preflight?.findings ?? []).filter(({ severity }) => severity === 'error').map(({ controller }) => controller);
  const all = controllers.filter((one) => failed.includes(one.name) || SILENT.includes(healthWord(one)));
  return all.slice(0, OFFERED).map(({ name }) => ({ what: 'disable', of: name }));
}

const showActions = onChange((actions) => byId('next-actions').replaceChildren(...actions.map(buttonOf)));

function buttonOf({ what, of }) {
  const text = {
    load: of ? words('load.cue', { cue: of }) : words('load.choose'), preflight: words('preflight.run'), disable: words('seat.disable', { which: of }), 'disable-all': words('seat.disable-all', { n: of?.length }),
  }[what];
  const button = make('button', { type: 'button', className: 'strong', 'data-do': what }, text);
  if (what === 'disable') return disable(button, of);
  if (what === 'disable-all') return disableAll(button, of);
  const actions = { load: () => (of ? loadCue(button) : byId('upload-file').focus()), preflight: () => runPreflight(button) };
  onPress(button, actions[what]);
  return button;
}

