// The state of the hall in large words, with its cause and the next action; how many seats take part; what is not as usual; the link.

import { sentAt } from './clock.js';
import { byId, setAttribute, setProperty, setStyle, setText } from './dom.js';
import { channelAnswers } from './channel.js';
import { seatsInPlay, worstOf } from './seats.js';
import { hasSpoken, needsToken, refusal, silence } from './stream.js';
import { hall, linkState } from './state.js';
import { askForToken } from './token.js';
import { words } from './language.js';
import { causeOf, nextOf, stateName, textOf } from './said.js';
import { nextStart } from './starts.js';
import { lasting, number, percent, sentence, signed } from './words.js';
import { timeOfDay, zone, zoneName } from './zone.js';

const BLINK_MS = 250;
/** Seats that are named. */
const NAMED = 4;
let spoken = '';

/** Keeps the time of day and the seconds of silence true while nothing comes. */
export function startHeadline() {
  byId('log-in').addEventListener('click', () => askForToken({ pressed: true }));
  setInterval(() => {
    showClock();
    if (linkState() === 'lost') showLink('lost');
  }, BLINK_MS);
}

/** In the zone of the hall, which is known with its first status. */
function showClock() {
  setText(byId('clock'), hall() ? timeOfDay(sentAt()) : '');
  setText(byId('zone'), hall() ? zoneName() : '');
  setProperty(byId('zone'), 'title', zone());
}

/** Shows the state, or that it is not known. */
export function showHeadline(status, link) {
  setAttribute(document.documentElement, 'data-link', link);
  showLink(link);
  for (const area of document.querySelectorAll('.live:not(.panel, .bar, #gravest)')) setProperty(area, 'inert', link === 'lost');
  if (status) showStatus(status, link);
}

function showLink(link) {
  // Whoever is asked for a token has lost nothing yet.
  const asked = !hasSpoken() && !byId('token').hidden;
  setProperty(byId('lost'), 'hidden', link !== 'lost' || asked);
  setProperty(byId('log-in'), 'hidden', !needsToken());
  setText(byId('lost-title'), words(channelAnswers() ? 'lost.silent' : 'lost.title'));
  setText(byId('link'), words(asked ? 'link.log-in' : `link.${link}`));
  const why = refusal() ?? words('lost.trying');
  setText(byId('lost-since'), words(hasSpoken() ? 'lost.for' : 'lost.yet', { s: number(silence()), why }));
}

function showStatus(status, link) {
  setAttribute(document.documentElement, 'data-state', status.state);
  setText(byId('hall'), status.hall);
  setText(byId('version'), words('page.version', { version: status.version, time: lasting(status.uptime_s) }));
  const seats = seatsInPlay(status.controllers);
  const worst = worstOf(status);
  const state = stateOf(status.state, worst);
  const next = nextAfter(worst, status);
  setAttribute(document.documentElement, 'data-worst', worst?.look ?? '');
  setText(byId('state'), link === 'live' ? state : `${state}?`);
  setStyle(byId('state'), '--chars', String(widthOf(state)));
  setText(byId('cause'), sentence(worst?.away ? whoStandsUp(status) : causeOf(status)));
  setText(byId('since'), times(status));
  setText(byId('next'), sentence(next));
  showInPlay(seats);
  const start = nextStart(status);
  badge('starts', start?.lapsing ?? (start?.armed ? words('badge.starts', { at: start.at }) : ''), 'weak', words(start?.lapsing ? 'start.lapses.why' : 'badge.starts.why'));
  badge('realtime', status.realtime.refusals.length > 0 ? words('badge.not-real-time') : '', 'weak', status.realtime.refusals.join('; '));
  const { text, planned } = settings(status);
  badge('settings-badge', text, planned ? 'calm' : 'weak', words(planned ? 'badge.planned' : 'badge.not-planned'));
  setProperty(document, 'title', [...(link === 'live' ? [state] : []), status.hall, 'kinocue'].join(' – '));
  const now = `${state}. ${sentence(causeOf(status))}. ${words('next.label')}${next}.`;
  if (now !== spoken) {
    spoken = now;
    setText(byId('spoken'), now);
  }
}

/** How wide a word is, in letters; those of Chinese and Japanese are half as wide again. */
const widthOf = (word) => [...word].reduce((sum, letter) => sum + (letter > '\u2e80' ? 1.5 : 1), 0);

/** The state of the hall, and that it is not true of the seats. */
function stateOf(state, worst) {
  const word = stateName(state);
  if (worst?.none) return words('in-play.none', { state: word });
  return worst?.away ? words('in-play.away', { state: word }) : word;
}

/** Of a hall that is parked but for these it is no cause that all are. */
function whoStandsUp({ warnings }) {
  const up = warnings.filter(({ id }) => id === 'not-at-park');
  return words('pair', { of: few(up.map(({ controller }) => controller)), text: textOf(up[0]) });
}

const few = (names) => names.slice(0, NAMED).join(', ') + (names.length > NAMED ? ` ${words('and-more', { n: names.length - NAMED })}` : '');

/** What a person does next: first about seats that are out, where nothing moves or the film leads none. */
function nextAfter(worst, status) {
  if (worst?.none) return words('next.no-seat');
  if (!worst?.names.length || worst.away || !['parked', 'armed'].includes(status.state)) return nextOf(status);
  if (worst.all) return words('next.all-silent', { n: worst.names.length, next: nextOf(status) });
  return words('next.seats-out', { seats: few(worst.names), next: nextOf(status) });
}

function times(status) {
  const lapses = status.lapses_s === null ? '' : `; ${words('since.lapses', { time: lasting(status.lapses_s) })}`;
  return `${words('since.for', { time: lasting(status.since_s) })}${lapses}`;
}

function showInPlay({ playing, all, failed }) {
  setProperty(byId('in-play'), 'hidden', all === 0);
  setProperty(byId('in-play'), 'className', `in-play look-${playing === all ? 'good' : failed ? 'bad' : 'weak'}`);
  setText(byId('in-play'), words('in-play', { playing, all }));
}

/** What is less or other than the whole cue in time with the film, and whether the entry that is loaded plans just that. */
function settings({ levels, trim_ms: trim, playlist, show }) {
  const current = playlist?.entries[playlist.current];
  const entry = current && current.cue === show?.cue ? current : { level: null, trim_ms: null, preset: null };
  // What a preset holds only the server knows: it may hold all but the trim.
  const byPreset = entry.preset !== null;
  const parts = [
    { text: words('badge.motion', { level: percent(levels.motion) }), usual: levels.motion === 1, planned: entry.level === null ? byPreset : entry.level === levels.motion },
    { text: words('badge.vibration', { level: percent(levels.vibration) }), usual: levels.vibration === 1, planned: byPreset },
    ...Object.entries(levels.rows).map(([row, level]) => ({ text: words('badge.row', { row, level: percent(level) }), usual: level === 1, planned: byPreset })),
    ...Object.entries(levels.effects).map(([name, on]) => ({ text: words('badge.off', { name }), usual: on, planned: byPreset })),
    { text: words('trim.to', { trim: signed(trim) }), usual: trim === 0, planned: entry.trim_ms === trim },
  ];
  const told = parts.filter(({ usual }) => !usual);
  return { text: told.map(({ text }) => text).join(', '), planned: told.every(({ planned }) => planned) };
}

/** A short word in view at all times; none where the text is empty. */
export function badge(id, text, look, why = '') {
  const element = byId(id);
  setProperty(element, 'hidden', text === '');
  setProperty(element, 'className', `badge look-${look}`);
  setText(element, text);
  setProperty(element, 'title', why);
}
