// The state of the hall in large words, with its cause and the next action; whether the seats may move; the link.

import { byId, setAttribute, setProperty, setText } from './dom.js';
import { hasSpoken, refusal, silence } from './stream.js';
import { linkState } from './state.js';
import { lasting, sentence, timeOfDay } from './words.js';

const BLINK_MS = 250;
let spoken = '';

/** Keeps the seconds of silence true while nothing comes. */
export function startHeadline() {
  setInterval(() => linkState() === 'lost' && showSilence(), BLINK_MS);
}

/** Shows the state, or that it is not known. */
export function showHeadline(status, link) {
  const root = document.documentElement;
  setAttribute(root, 'data-link', link);
  setProperty(byId('lost'), 'hidden', link !== 'lost');
  const linkWords = { live: 'connected', lost: 'no data', connecting: 'connecting' };
  setText(byId('link'), linkWords[link]);
  for (const area of document.querySelectorAll('.live')) setProperty(area, 'inert', link === 'lost');
  if (link === 'lost') showSilence();
  if (status) showStatus(status, link);
}

function showSilence() {
  const why = refusal() ?? 'trying to reach it';
  const since = hasSpoken() ? `for ${silence().toFixed(0)} s; ${why}.` : `yet; ${why}.`;
  setText(byId('lost-since'), since);
}

function showStatus(status, link) {
  const root = document.documentElement;
  setAttribute(root, 'data-state', status.state);
  setText(byId('hall'), status.hall);
  setText(byId('version'), `kinocue ${status.version}, up ${lasting(status.uptime_s)}`);
  setText(byId('state'), link === 'lost' ? `${status.state}?` : status.state);
  setText(byId('cause'), sentence(status.cause));
  setText(byId('since'), times(status));
  setText(byId('next'), sentence(status.next));
  badge('moving', status.moving, status.state === 'paused' ? 'seats are held' : 'seats in motion', 'frames are being sent to the seats');
  const start = status.state === 'armed' ? status.playlist?.next_start : null;
  badge('starts', Boolean(start), `starts by itself at ${timeOfDay(start ?? '')}`, 'disarm to prevent it');
  badge('realtime', status.realtime.refusals.length > 0, 'not real-time', status.realtime.refusals.join('; '));
  setProperty(document, 'title', `${status.state} – ${status.hall} – kinocue`);
  const now = `${status.state}. ${sentence(status.cause)}. Next: ${status.next}.`;
  if (now !== spoken) {
    spoken = now;
    setText(byId('spoken'), now);
  }
}

function times(status) {
  const lapses = status.lapses_s === null ? '' : `; lapses in ${lasting(status.lapses_s)}`;
  return `for ${lasting(status.since_s)}${lapses}`;
}

function badge(id, shown, text, why) {
  const element = byId(id);
  setProperty(element, 'hidden', !shown);
  setText(element, text);
  setProperty(element, 'title', why);
}
