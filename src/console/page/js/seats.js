// What is true of the seats as a whole, where the state of the hall alone says less.

import { takesPart } from './marks.js';

/** States in which the film leads seats: with none that takes part the large word would say what nobody sees in the hall. */
const LEADING = new Set(['joining', 'playing']);
/** States that say of all seats where they are, or what they do. */
const OF_ALL = new Set([...LEADING, 'parked', 'armed', 'waiting', 'holding', 'paused']);

/** Those that should take part and do not; one that has to be homed is what the hall says is next. */
export const isOut = (controller) => controller.enabled && !takesPart(controller) && !['out', 'excluded'].includes(controller.health);

/** How many seats take part, and how many the configuration has; a seat of several controllers needs them all. */
export function seatsInPlay(controllers) {
  const seats = new Map();
  for (const controller of controllers) {
    if (controller.health === 'out') continue;
    seats.set(controller.group, (seats.get(controller.group) ?? true) && takesPart(controller));
  }
  const playing = [...seats.values()].filter(Boolean).length;
  const failed = controllers.some((controller) => controller.enabled && !takesPart(controller) && controller.health !== 'out');
  return { playing, all: seats.size, failed };
}

/** Whether all fell silent at one instant, which is one cause and no seat's. */
export const isAllSilent = ({ warnings }) => warnings.some(({ id }) => id === 'all-silent');

/**
 * The worst that is true of the seats, by its look, with the names of those that are out; null where it is as the state says. `none` where the
 * film leads no seat, `away` where one is not at park though the hall is.
 */
export function worstOf(status) {
  const { state, controllers, warnings } = status;
  const none = LEADING.has(state) && seatsInPlay(controllers).playing === 0;
  const names = controllers.filter(isOut).map(({ name }) => name);
  const away = warnings.some(({ id }) => id === 'not-at-park');
  const worst = { none, away, names, all: isAllSilent(status) };
  if (none || away) return { ...worst, look: 'bad' };
  return OF_ALL.has(state) && names.length > 0 ? { ...worst, look: names.length === controllers.length ? 'bad' : 'weak' } : null;
}
