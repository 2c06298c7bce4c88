// The state of the hall in large words, with its cause and the next action; how many seats take part; what is not as usual; the link.

import { sentAt } from './clock.js';
import { byId, setAttribute, setProperty, setText } from './dom.js';
import { takesPart } from './marks.js';
import { hasSpoken, refusal, silence } from './stream.js';
import { linkState } from './state.js';
import { lasting, percent, sentence, signed, timeOfDay } from './words.js';

const BLINK_MS = 250;
const LINK_WORDS = { live: 'connected', lost: 'no data', connecting: 'connecting' };
let spoken = '';

/** Keeps the time of day and the seconds of silence true while nothing comes. */
export function startHeadline() {
  setInterval(() => {
    setText(byId('clock'), new Date(sentAt()).toLocaleTimeString('en-GB'));
    if (linkState() === 'lost') showSilence();
  }, BLINK_MS);
}

/** Shows the state, or that it is not known. */
export function showHeadline(status, link) {
  setAttribute(document.documentElement, 'data-link', link);
  // Whoever is asked for a token has lost nothing yet.
  const asked = !hasSpoken() && !byId('token').hidden;
  setProperty(byId('lost'), 'hidden', link !== 'lost' || asked);
  setText(byId('link'), asked ? 'log in' : LINK_WORDS[link]);
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
  setAttribute(document.documentElement, 'data-state', status.state);
  setText(byId('hall'), status.hall);
  setText(byId('version'), `kinocue ${status.version}, up ${lasting(status.uptime_s)}`);
  setText(byId('state'), link === 'lost' ? `${status.state}?` : status.state);
  setText(byId('cause'), sentence(status.cause));
  setText(byId('since'), times(status));
  setText(byId('next'), sentence(status.next));
  showInPlay(status.controllers);
  const start = status.state === 'armed' ? status.playlist?.next_start : null;
  badge('starts', start ? `starts by itself at ${timeOfDay(start)}` : '', 'weak', 'disarm to prevent it');
  badge('realtime', status.realtime.refusals.length > 0 ? 'not real-time' : '', 'weak', status.realtime.refusals.join('; '));
  const { words, planned } = settings(status);
  badge('settings-badge', words, planned ? 'calm' : 'weak', planned ? 'as the playlist has it' : 'not as planned');
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

/** Seats that take part, of all that the configuration has; a seat of several controllers needs them all. */
function showInPlay(controllers) {
  const seats = new Map();
  for (const controller of controllers) {
    if (controller.health === 'out') continue;
    seats.set(controller.group, (seats.get(controller.group) ?? true) && takesPart(controller));
  }
  const playing = [...seats.values()].filter(Boolean).length;
  const failed = controllers.some((controller) => controller.enabled && !takesPart(controller) && controller.health !== 'out');
  setProperty(byId('in-play'), 'hidden', seats.size === 0);
  setProperty(byId('in-play'), 'className', `in-play look-${playing === seats.size ? 'good' : failed ? 'bad' : 'weak'}`);
  setText(byId('in-play'), `${playing} of ${seats.size} seats`);
}

/** What is less or other than the whole cue in time with the film, and whether the entry that is loaded plans just that. */
function settings({ levels, trim_ms: trim, playlist, show }) {
  const current = playlist?.entries[playlist.current];
  const entry = current && current.cue === show?.cue ? current : { level: null, trim_ms: null, preset: null };
  // What a preset holds only the server knows: it may hold all but the trim.
  const byPreset = entry.preset !== null;
  const parts = [
    { words: `motion ${percent(levels.motion)}`, usual: levels.motion === 1, planned: entry.level === null ? byPreset : entry.level === levels.motion },
    { words: `vibration ${percent(levels.vibration)}`, usual: levels.vibration === 1, planned: byPreset },
    ...Object.entries(levels.rows).map(([row, level]) => ({ words: `row ${row} ${percent(level)}`, usual: level === 1, planned: byPreset })),
    ...Object.entries(levels.effects).map(([name, on]) => ({ words: `${name} off`, usual: on, planned: byPreset })),
    { words: `trim ${signed(trim)}`, usual: trim === 0, planned: entry.trim_ms === trim },
  ];
  const told = parts.filter(({ usual }) => !usual);
  return { words: told.map(({ words }) => words).join(', '), planned: told.every(({ planned }) => planned) };
}

/** A short word in view at all times; none where the text is empty. */
export function badge(id, text, look, why = '') {
  const element = byId(id);
  setProperty(element, 'hidden', text === '');
  setProperty(element, 'className', `badge look-${look}`);
  setText(element, text);
  setProperty(element, 'title', why);
}
