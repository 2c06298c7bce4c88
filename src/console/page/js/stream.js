// The statuses of the hall: by the channel, begun anew when it ends, and noticed when they fall silent. A page that nobody sees has no
// channel, and says nothing of the hall.

import { channelAnswers, endChannel, openChannel } from './channel.js';
import { readEvents } from './events.js';
import { setAway, setLost, setStatus } from './state.js';
import { askForToken, onToken } from './token.js';
import { words } from './language.js';

const SILENCE_MS = 1500;
const WATCH_MS = 100;
const FIRST_WAIT_MS = 100;
const LONGEST_WAIT_MS = 1000;
/** How long events are read before the channel is tried again. */
const EVENTS_MS = 30_000;

let heard = performance.now();
let everHeard = false;
/** Since when somebody sees the page. */
let seen = performance.now();
let attempt = null;
let wakeUp = () => {};
let refused = null;
/** Whether the channel ever was one: where it is, no events are read, which would hold a connection that a STOP may need. */
let hasChannel = false;

/** Seconds since the last status. */
export const silence = () => (performance.now() - heard) / 1000;

/** Whether there ever was one. */
export const hasSpoken = () => everHeard;

/** Why the server does not speak, where it said so; null where nobody knows. */
export const refusal = () => refused;

/** Whether it says that it needs a token. */
export const needsToken = () => refused === words('lost.token');

/** Listens for as long as the page is open. */
export async function startStream() {
  setInterval(watchSilence, WATCH_MS);
  document.addEventListener('visibilitychange', onSeen);
  onToken(() => wakeUp());
  for (let wait = FIRST_WAIT_MS; ; wait = Math.min(wait * 2, LONGEST_WAIT_MS)) {
    if (document.hidden) await new Promise((resolve) => (wakeUp = resolve));
    const before = heard;
    await listen();
    if (heard !== before) wait = FIRST_WAIT_MS;
    await new Promise((resolve) => {
      wakeUp = resolve;
      setTimeout(resolve, wait);
    });
  }
}

function onSeen() {
  if (document.hidden) {
    setAway();
    attempt?.end();
  } else {
    seen = performance.now();
    wakeUp();
  }
}

/** One that is open but silent is as good as none: it is ended, and another one tried. It stays where it still takes a STOP. */
function watchSilence() {
  const now = performance.now();
  if (document.hidden || now - Math.max(heard, seen) < SILENCE_MS) return;
  setLost();
  if (attempt && now - attempt.begun > SILENCE_MS && !channelAnswers()) attempt.end();
}

async function listen() {
  attempt = { begun: performance.now(), end: endChannel };
  const spoke = await openChannel({ take, refuse }).catch(() => false);
  if (!spoke) refused = null;
  hasChannel ||= spoke;
  if (hasChannel || document.hidden) return;
  const abort = new AbortController();
  setTimeout(() => abort.abort(), EVENTS_MS);
  attempt = { begun: performance.now(), end: () => abort.abort() };
  await readEvents({ take, refuse, signal: abort.signal }).catch(() => { refused = null; });
}

function refuse(problem, shown) {
  refused = problem.status === 401 ? words('lost.token') : problem.detail ?? words('api.replied', { status: problem.status });
  if (problem.status === 401) askForToken({ pressed: false, shown });
}

function take(status) {
  heard = performance.now();
  everHeard = true;
  refused = null;
  setStatus(status);
}
