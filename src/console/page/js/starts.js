// Automatic starts of the playlist: when the next one is, in how long, and that it will not be where arming lapses before.

import { lasting } from './words.js';
import { timeOfDay } from './zone.js';
import { words } from './language.js';

/** When and in how long something starts: 19:00:00, in 12 min. */
export const atIn = (at, seconds) => words('start.at', { at, time: lasting(seconds) });

/** The next one of all; null where none is. `lapsing` says that arming ends before. */
export function nextStart({ playlist, state, lapses_s: lapses }) {
  if (!playlist?.next_start) return null;
  const wait = Math.min(...playlist.entries.map(({ starts_in_s: wait }) => wait ?? Infinity));
  const at = atIn(timeOfDay(playlist.next_start), wait);
  const armed = state === 'armed';
  const lapsing = armed && lapses !== null && lapses < wait ? words('start.lapses', { at, time: lasting(lapses) }) : null;
  return { at, armed, lapsing };
}
