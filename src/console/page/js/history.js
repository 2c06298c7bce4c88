// The last shows of the journal: what came of each, what its recording says, and its picture.

import { byId, make, onChange, setProperty, setText } from './dom.js';
import { get } from './api.js';
import { showPicture } from './picture.js';
import { endingName } from './said.js';
import { clock, percent, whole } from './words.js';
import { dayAndTime } from './zone.js';
import { said, words } from './language.js';

/** Reads the shows anew when one begins or ends, and when another recording is whole. */
export function showHistory(status, link) {
  if (status && link === 'live') read([status.state, status.record?.last, status.timezone]);
}

const read = onChange(() => {
  get('history').then(show, () => {});
});

function show(shows) {
  setProperty(byId('history'), 'hidden', shows.length === 0);
  setText(byId('history-none'), shows.length === 0 ? words('history.none') : '');
  byId('history').tBodies[0].replaceChildren(...shows.map(line));
}

function line({ start, cue, title, result, lost, missed_ticks: missed, recorded }) {
  const when = dayAndTime(start);
  const { clamps = 0, marks = 0, nearest = null, name = null } = recorded ?? {};
  const figures = [
    lost > 0 && words('recordings.lost', { n: whole(lost) }),
    missed > 0 && words('recordings.missed', { n: whole(missed) }),
    clamps > 0 && words('history.clamps', { n: whole(clamps) }),
    marks > 0 && words('history.marks', { n: whole(marks) }),
  ].filter(Boolean);
  const ended = make('span', {}, [came(result), ...figures].join(', '), ...least(nearest));
  const cells = [when, title ?? cue, ended, name === null ? '–' : picture(name, title ?? cue, when)];
  return make('tr', { title: cue }, ...cells.map((cell) => make('td', {}, cell)));
}

const came = (result) => (['interrupted', 'running'].includes(result) ? words(`history.${result}`) : endingName(result));

/** What came nearest to its limit. */
function least(nearest) {
  if (nearest === null) return [];
  const { of, seat, axis, left, at_s: at } = nearest;
  const text = words('margins.spoken', { what: said('margin', { code: of }, of), part: percent(left), axis: `${seat} a${axis}`, at: clock(at) });
  return [make('p', { className: 'quiet' }, words('pair', { of: words('history.margin'), text }))];
}

function picture(name, what, when) {
  const kind = words('recordings.show');
  const look = make('button', { type: 'button', 'aria-label': words('picture.of', { kind, what, when }) }, words('picture'));
  look.addEventListener('click', () => showPicture(name, `${kind} ${what}, ${when}`));
  return look;
}
