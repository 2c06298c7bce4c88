// What is shown by colour is shown by a mark and a word too: the health of controllers, and how good a figure is.

import { draw } from './dom.js';

/** Every health: its class of colour and its mark. */
export const HEALTH = {
  ok: { look: 'good', mark: 'disc' },
  unwatched: { look: 'calm', mark: 'ring' },
  degraded: { look: 'weak', mark: 'half' },
  rejoining: { look: 'calm', mark: 'turn' },
  lost: { look: 'bad', mark: 'cross' },
  error: { look: 'fault', mark: 'peak' },
  stopped: { look: 'held', mark: 'block' },
  excluded: { look: 'homeless', mark: 'house' },
  disabled: { look: 'away', mark: 'dash' },
  out: { look: 'away', mark: 'gap' },
  unknown: { look: 'away', mark: 'what' },
};

/** The word for how a controller stands; one that a person took out is called that, however well it answers. */
export const healthWord = ({ enabled, health }) => (enabled || health === 'out' ? health : 'disabled');

/** How a controller stands. */
export const healthOf = (controller) => HEALTH[healthWord(controller)] ?? HEALTH.unknown;

/** Whether a controller follows a show. */
export const takesPart = (controller) => ['ok', 'degraded', 'unwatched'].includes(healthWord(controller));

/** Every state of a film: its class of colour and its mark. */
const FILM = {
  locked: { look: 'good', mark: 'disc' },
  acquiring: { look: 'calm', mark: 'turn' },
  jumped: { look: 'calm', mark: 'turn' },
  freewheeling: { look: 'weak', mark: 'half' },
  stopped: { look: 'held', mark: 'block' },
  ended: { look: 'away', mark: 'dash' },
  absent: { look: 'away', mark: 'what' },
  reverse: { look: 'bad', mark: 'peak' },
  shuttle: { look: 'bad', mark: 'peak' },
  unusable: { look: 'bad', mark: 'peak' },
  lost: { look: 'bad', mark: 'cross' },
};

/** One that nobody follows at present cannot be lost: it is as good as over. */
export const filmStateOf = ({ state, film }) => (film.state === 'lost' && ['parking', 'parked'].includes(state) ? 'absent' : film.state);

/** How a film or a source of one is shown. */
export const filmLook = (state) => FILM[state] ?? FILM.absent;

/** The bands of a figure. */
export const BANDS = {
  good: { look: 'good', mark: 'disc' },
  weak: { look: 'weak', mark: 'half' },
  bad: { look: 'bad', mark: 'cross' },
  none: { look: 'away', mark: 'what' },
};

const SHAPES = {
  disc: () => [draw('circle', { cx: 12, cy: 12, r: 9, class: 'fill' })],
  ring: () => [draw('circle', { cx: 12, cy: 12, r: 7.5, class: 'line' })],
  half: () => [draw('circle', { cx: 12, cy: 12, r: 8, class: 'line' }), draw('path', { d: 'M12 4a8 8 0 0 1 0 16z', class: 'fill' })],
  turn: () => [draw('path', { d: 'M5 12a7 7 0 1 1 3 5.7M8 13v5h5', class: 'line' })],
  cross: () => [draw('path', { d: 'M5 5 19 19M19 5 5 19', class: 'line' })],
  peak: () => [draw('path', { d: 'M12 3 22 21H2z', class: 'fill' }), draw('path', { d: 'M12 9v6M12 17.4v1.6', class: 'hole' })],
  block: () => [draw('rect', { x: 4, y: 4, width: 16, height: 16, class: 'fill' })],
  house: () => [draw('path', { d: 'M3 12 12 4l9 8M6 10v10h12V10', class: 'line' })],
  gap: () => [draw('path', { d: 'M3 12h5M16 12h5', class: 'line' })],
  dash: () => [draw('path', { d: 'M4 12h16', class: 'line' })],
  what: () => [draw('path', { d: 'M8 9a4 4 0 1 1 5.5 3.7c-1 .5-1.5 1-1.5 2.3M12 18v1.5', class: 'line' })],
  info: () => [draw('circle', { cx: 12, cy: 12, r: 9, class: 'line' }), draw('path', { d: 'M12 11v6M12 6.6v1', class: 'line' })],
};

/** A mark as a picture; hidden from screen readers, which are told the word. */
export const mark = (name) => draw('svg', { viewBox: '0 0 24 24', class: 'mark', 'aria-hidden': 'true' }, ...SHAPES[name]());

/** Acks over frames: from 99.5 % on good, from 95 % on weak. */
export function ackBand(rate) {
  if (rate === null) return BANDS.none;
  if (rate >= 0.995) return BANDS.good;
  return rate >= 0.95 ? BANDS.weak : BANDS.bad;
}

/** The latency that 99 of 100 acks keep: up to 2 ms good, up to 10 ms weak. */
export function latencyBand(us) {
  if (us === null) return BANDS.none;
  if (us <= 2000) return BANDS.good;
  return us <= 10_000 ? BANDS.weak : BANDS.bad;
}
