// STOP: acts when the finger comes down, by the Escape key from anywhere on the page, also while nothing is heard from the
// server. It is never asked twice whether it is meant. A script of its own, so that a fault elsewhere in the page leaves it be.

import { byId, setProperty, setText } from './dom.js';
import { sendStop } from './api.js';
import { hall, linkState, watch } from './state.js';
import { words } from './language.js';
import { stateName } from './said.js';

const TRIES = 4;
const PATIENCE_MS = 1000;
const BETWEEN_MS = 150;

let sending = false;
/** Whether nothing was heard of the server at some time since the last word about a stop. */
let wasGone = false;

function start() {
  const button = byId('stop');
  button.addEventListener('pointerdown', (event) => event.button === 0 && stop());
  // A click without a pointer is the Enter or space key, or a screen reader.
  button.addEventListener('click', (event) => event.detail === 0 && stop());
  document.addEventListener('keydown', onKey, { capture: true });
  watch(forget);
}

function onKey(event) {
  if (event.key !== 'Escape') return;
  event.preventDefault();
  if (!event.repeat) stop();
}

/** Tries a few times: of a stop there is never one too many. */
async function stop() {
  byId('stop').classList.add('pressed');
  if (sending) return;
  sending = true;
  tell(words('stop.sent'), 'sent');
  let problem = null;
  for (let attempt = 0; attempt < TRIES; attempt += 1) {
    try {
      await sendStop(PATIENCE_MS);
      problem = null;
      tell(words('stop.received'), 'received');
      break;
    } catch (error) {
      problem = error;
      tell(words('stop.trying', { why: error.message }), 'failed');
      if (error.status !== 0 && error.status < 500) break; // they heard and refused: again would be the same
      await new Promise((resolve) => setTimeout(resolve, BETWEEN_MS));
    }
  }
  if (problem) tell(words('stop.failed', { why: problem.words ?? problem.message }), 'failed');
  byId('stop').classList.remove('pressed');
  sending = false;
}

function tell(text, kind) {
  wasGone = linkState() !== 'live';
  const place = byId('stop-reply');
  setText(place, text);
  setProperty(place, 'className', `stop-reply ${kind}`);
  setProperty(place, 'hidden', false);
}

/**
 * That a stop was received is old once the hall is no longer stopped. That it was not stays until the hall is stopped; where the
 * server was gone meanwhile and is back, it is over if nothing moves, and else said of what moves.
 */
function forget() {
  const place = byId('stop-reply');
  if (linkState() !== 'live') wasGone = true;
  if (sending || place.hidden || linkState() !== 'live') return;
  const { state, moving } = hall();
  const received = place.classList.contains('received');
  const over = received ? state !== 'stopping' && state !== 'stopped' : state === 'stopped' || (wasGone && !moving);
  if (over) setProperty(place, 'hidden', true);
  else if (!received && wasGone) setText(place, words('stop.again', { state: stateName(state) }));
}

start();
