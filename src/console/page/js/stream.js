// The stream of statuses: read as it comes, begun anew when it ends, and noticed when it falls silent.
// An EventSource cannot send a token, hence fetch and a reader.

import { headers } from './api.js';
import { hear } from './clock.js';
import { setLost, setStatus } from './state.js';
import { askForToken, onToken, token } from './token.js';
import { words } from './language.js';

const SILENCE_MS = 1500;
const WATCH_MS = 100;
const FIRST_WAIT_MS = 100;
const LONGEST_WAIT_MS = 1000;

let heard = performance.now();
let everHeard = false;
let attempt = null;
let wakeUp = () => {};
let refused = null;

/** Seconds since the last status. */
export const silence = () => (performance.now() - heard) / 1000;

/** Whether there ever was one. */
export const hasSpoken = () => everHeard;

/** Why the server does not speak, where it said so; null where nobody knows. */
export const refusal = () => refused;

/** Whether it says that it needs a token. */
export const needsToken = () => refused === words('lost.token');

/** Reads for as long as the page is open. */
export async function startStream() {
  setInterval(watchSilence, WATCH_MS);
  document.addEventListener('visibilitychange', () => document.hidden || watchSilence());
  onToken(() => wakeUp());
  for (let wait = FIRST_WAIT_MS; ; wait = Math.min(wait * 2, LONGEST_WAIT_MS)) {
    const before = heard;
    await read().catch(() => { refused = null; });
    if (heard !== before) wait = FIRST_WAIT_MS;
    await new Promise((resolve) => {
      wakeUp = resolve;
      setTimeout(resolve, wait);
    });
  }
}

/** A stream that is open but silent is as good as none: it is ended, and another one tried. */
function watchSilence() {
  const silent = performance.now() - heard;
  if (silent < SILENCE_MS) return;
  setLost();
  if (attempt && performance.now() - attempt.begun > SILENCE_MS && silent > SILENCE_MS) attempt.abort.abort();
}

async function read() {
  attempt = { begun: performance.now(), abort: new AbortController(), shown: token() };
  const response = await fetch('/api/v1/events', {
    headers: headers({ Accept: 'text/event-stream' }),
    cache: 'no-store',
    credentials: 'omit',
    redirect: 'error',
    signal: attempt.abort.signal,
  });
  hear(response.headers, attempt.begun);
  refused = response.ok ? null : await refusalOf(response);
  if (!response.ok) return;
  let text = '';
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    const events = (text + value.replaceAll('\r', '')).split('\n\n');
    text = events.pop();
    // Of several that came at once only the last is still true.
    const newest = events.map(dataOf).filter((data) => data !== '').pop();
    if (newest !== undefined) take(newest);
  }
}

async function refusalOf(response) {
  if (response.status === 401) {
    askForToken({ pressed: false, shown: attempt.shown });
    return words('lost.token');
  }
  const problem = await response.json().catch(() => ({}));
  return problem.detail ?? words('api.replied', { status: response.status });
}

/** The data of an event: its data lines, joined. Comments have none. */
function dataOf(event) {
  const lines = event.split('\n').filter((line) => line.startsWith('data:'));
  return lines.map((line) => line.slice(line.startsWith('data: ') ? 6 : 5)).join('\n');
}

function take(data) {
  const status = JSON.parse(data);
  heard = performance.now();
  everHeard = true;
  setStatus(status);
}
