// Instants as people in the hall read them: all in its one zone, which each status names, whatever zone this machine is in.

import { hall } from './state.js';
import { spoken } from './language.js';

const known = new Map();

/** A zone that this browser does not know is UTC, and is called that. */
function usable(zone) {
  if (!known.has(zone)) {
    try {
      new Intl.DateTimeFormat('en', { timeZone: zone });
      known.set(zone, zone);
    } catch {
      known.set(zone, 'UTC');
    }
  }
  return known.get(zone);
}

/** The zone of the hall. */
export const zone = () => usable(hall()?.timezone || 'UTC');

/** The name by which people know it: Berlin, UTC, +01:00. */
export const zoneName = () => zone().split('/').at(-1).replaceAll('_', ' ');

/** An instant as `2026-01-31 19:00:00`; null where it is none. */
function local(instant) {
  const at = new Date(instant);
  return Number.isNaN(at.getTime()) ? null : new Intl.DateTimeFormat('sv', { dateStyle: 'short', timeStyle: 'medium', timeZone: zone() }).format(at);
}

/** Its time of day. */
export const timeOfDay = (instant) => local(instant)?.slice(11) ?? instant;

/** Its day, short. */
export const dayOf = (instant) => new Intl.DateTimeFormat(spoken(), { dateStyle: 'short', timeZone: zone() }).format(new Date(instant));

/** Both. */
export const dayAndTime = (instant) => (local(instant) === null ? instant : `${dayOf(instant)} ${timeOfDay(instant)}`);

/** Whether two instants are of one day. */
export const isOneDay = (one, other) => local(one)?.slice(0, 10) === local(other)?.slice(0, 10);
