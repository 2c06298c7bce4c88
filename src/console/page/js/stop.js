// STOP: acts when the finger comes down, by the Escape key from anywhere on the page, also while nothing is heard from the
// server. It is never asked twice whether it is meant. A script of its own, so that a fault elsewhere in the page leaves it be.

import { byId, setProperty, setText } from './dom.js';
import { sendStop } from './api.js';
import { stopByChannel } from './channel.js';
import { startReach } from './reach.js';
import { hall, linkState, watch } from './state.js';
import { words } from './language.js';
import { stateName } from './said.js';

const TRIES = 4;
const PATIENCE_MS = 1000;
const BETWEEN_MS = 150;
/** By when the hall that has received a stop says that it stops. */
const STOPS_MS = 3000;

let sending = false;
/** Whether nothing was heard of the server at some time since the last word about a stop. */
let wasGone = false;
/** When that was said, and whether the hall has stopped since. */
let told = 0;
let hasStopped = false;

function start() {
  const button = byId('stop');
  button.addEventListener('pointerdown', (event) => event.button === 0 && stop());
  // A click without a pointer is the Enter or space key, or a screen reader.
  button.addEventListener('click', (event) => event.detail === 0 && stop());
  document.addEventListener('keydown', onKey, { capture: true });
  watch(forget);
  startReach();
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
      await deliver();
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

/** By the channel and by a plain request, as either may be held up; of two stops the second does nothing. */
async function deliver() {
  const plain = sendStop(PATIENCE_MS);
  await Promise.any([stopByChannel(PATIENCE_MS), plain]).catch(() => plain);
}

function tell(text, kind) {
  [wasGone, told, hasStopped] = [linkState() !== 'live', performance.now(), false];
  const place = byId('stop-reply');
  setText(place, text);
  setProperty(place, 'className', `stop-reply ${kind}`);
  setProperty(place, 'hidden', false);
}

/**
 * That a stop was received is old once the hall is no longer stopped; the word of it comes before the state. That it was not stays until the hall is stopped; where the
 * server was gone meanwhile and is back, it is over if nothing moves, and else said of what moves.
 */
function forget() {
  const place = byId('stop-reply');
  if (linkState() !== 'live') wasGone = true;
  if (sending || place.hidden || linkState() !== 'live') return;
  const { state, moving } = hall();
  const received = place.classList.contains('received');
  const stops = state === 'stopping' || state === 'stopped';
  hasStopped ||= stops;
  const over = received ? !stops && (hasStopped || performance.now() - told > STOPS_MS) : state === 'stopped' || (wasGone && !moving);
  if (over) setProperty(place, 'hidden', true);
  else if (!received && wasGone) setText(place, words('stop.again', { state: stateName(state) }));
}

start();
