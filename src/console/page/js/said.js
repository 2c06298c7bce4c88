// What the hall says, in the language of the page: by its codes where there are any, else as it came.

import { said, words } from './language.js';
import { sentAt } from './clock.js';
import { dayAndTime, isOneDay, timeOfDay } from './zone.js';

const OF_CONTROLLER = 'controller-';

/** The word for a state of the hall. */
export const stateName = (state) => said('state', { code: state }, state);

/** The word for how a controller stands. */
export const healthName = (health) => said('health', { code: health }, health);

/** The word for a state of a film. */
export const filmName = (state) => said('film-state', { code: state }, state);

/** The word for how a show ended. */
export const endingName = (ending) => said('ending', { code: ending }, ending);

/** Why the hall is in its state, beginning with whose doing that is. */
export function causeOf({ cause, cause_coded: coded }) {
  const text = said('cause', coded ?? {}, null);
  if (text === null) return cause;
  return coded.of?.length > 0 ? words('pair', { of: coded.of[0], text }) : text;
}

/** What a person does next. */
export const nextOf = ({ next, next_coded: coded }) => said('next', coded ?? {}, next);

/** What a source says of the film, and what is wrong with the source. */
export function filmCause({ state, cause, trouble }) {
  const runs = state === 'locked' || state === 'free-running';
  const means = runs ? said('film-means', { code: 'runs' }, null) : said('cause', { code: `film-${state}` }, null);
  if (means === null) return cause;
  return trouble ? words('pair', { of: means, text: trouble }) : means;
}

/** What a person does next about the film. */
export const filmNext = ({ next, next_coded: coded }) => said('film-next', coded ?? {}, next);

/** What is the matter. */
export function textOf({ id, text, coded }) {
  if (id.startsWith(OF_CONTROLLER)) {
    const why = said('standing', coded ?? {}, null);
    return why === null ? text : words('pair', { of: healthName(id.slice(OF_CONTROLLER.length)), text: why });
  }
  const known = coded ? said('warning', { ...coded, of: coded.of?.map(moment) }, null) : null;
  const title = said('warning', { code: id }, null);
  return known ?? (title === null ? text : words('pair', { of: title, text }));
}

/** What to do about it. */
export const remedyOf = ({ remedy, remedy_code: code }) => said('remedy', { code }, remedy);

/** A time as people say it: of today without its day. */
function moment(value) {
  if (!/^\d{4}-\d\d-\d\dT\d\d:\d\d/.test(value)) return value;
  return (isOneDay(value, sentAt()) ? timeOfDay(value) : dayAndTime(value)).slice(0, -3);
}
