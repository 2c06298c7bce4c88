// Trim: how much later than the film the motion is.

import { byId, setProperty, setText } from './dom.js';
import { change } from './api.js';
import { ask, onPress } from './press.js';
import { hall } from './state.js';
import { signed } from './words.js';
import { words } from './language.js';

const MOST_MS = 500;
const SETTLE_MS = 400;

// Presses that come faster than replies add up: each goes on from the one before.
let wanted = null;
let asked = 0;

/** Makes the buttons work. */
export function startTrim() {
  for (const button of document.querySelectorAll('[data-trim]')) {
    button.addEventListener('click', () => press(button, Number(button.dataset.trim)));
  }
  for (const button of nudges()) onPress(button, () => nudge(button, Number(button.dataset.nudge)));
}

async function press(button, step) {
  const from = wanted ?? hall()?.trim_ms ?? 0;
  wanted = step === 0 ? 0 : Math.min(Math.max(from + step, -MOST_MS), MOST_MS);
  const mine = (asked += 1);
  const to = wanted;
  show(to);
  await ask(button, words('trim.to', { trim: signed(to) }), () => change('PUT', 'trim', { offset_s: to / 1000 }));
  forget(mine);
}

/** From the next status on the server is believed again. */
function forget(mine) {
  setTimeout(() => {
    if (mine === asked) wanted = null;
  }, SETTLE_MS);
}

const nudges = () => document.querySelectorAll('[data-nudge]');

/** Only the server knows how long a frame is: what it makes of the press is what the next goes on from. */
async function nudge(button, frames) {
  const mine = (asked += 1);
  await ask(button, words(frames > 0 ? 'trim.nudged-later' : 'trim.nudged-earlier'), async () => {
    const status = await change('PUT', 'trim', { frames });
    if (mine === asked) show((wanted = status.trim_ms));
    return status;
  });
  forget(mine);
}

/** Shows the trim of the hall; by frames only where there is a film. */
export function showTrim(status) {
  for (const button of nudges()) setProperty(button, 'hidden', !status?.film);
  if (status && wanted === null) show(status.trim_ms);
}

function show(ms) {
  setText(byId('trim'), signed(ms));
  const how = ms === 0 ? 'trim.in-sync' : ms > 0 ? 'trim.is-later' : 'trim.is-earlier';
  setText(byId('trim-words'), words(how, { ms: Math.abs(ms) }));
}
