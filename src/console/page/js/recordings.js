// What is recorded: the badge, the mark of a moment (a button and the key M), and the last recordings.

import { byId, make, onChange, setProperty, setText } from './dom.js';
import { badge } from './headline.js';
import { change, get } from './api.js';
import { ask, onPress } from './press.js';
import { hall } from './state.js';
import { showPicture } from './picture.js';
import { endingName } from './said.js';
import { clock, number, whole } from './words.js';
import { dayAndTime } from './zone.js';
import { words } from './language.js';

const SHOWN = 20;
const KINDS = ['show', 'test', 'homing', 'incident'];

/** Makes the button and the key work. */
export function startRecordings() {
  onPress(byId('mark'), mark);
  document.addEventListener('keydown', onKey);
}

function onKey(event) {
  if (event.key.toLowerCase() !== 'm' || event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
  // Whoever writes a word with an m in it marks nothing.
  if (event.target.closest('input, textarea, select, [contenteditable]')) return;
  if (!byId('mark').closest('[inert]')) byId('mark').click();
}

function mark(button) {
  const at = hall()?.show?.position_s ?? null;
  ask(button, at === null ? words('mark') : words('mark.at', { at: clock(at) }), () => change('POST', 'record/mark'));
}

/** Shows whether anything is recorded, and what was. */
export function showRecordings(status, link) {
  if (!status?.record) return;
  const { recording, flight_s: flight, troubles } = status.record;
  const trouble = troubles.show ?? troubles.room;
  badge('record-badge', trouble ? words('badge.not-recorded') : recording ? words('badge.recording') : '', trouble ? 'weak' : 'calm', trouble ?? '');
  setProperty(byId('mark'), 'disabled', link !== 'live' || (flight === 0 && !recording));
  readList([status.record.last, status.timezone]);
}

/** Reads the list anew whenever another file is whole. */
const readList = onChange(() => {
  get('recordings').then(showList, () => {});
});

function showList(list) {
  const lines = list.slice(0, SHOWN).map((recording) => {
    const { when, kind, what } = parts(recording);
    const look = make('button', { type: 'button', 'aria-label': words('picture.of', { kind, what, when }) }, words('picture'));
    look.addEventListener('click', () => showPicture(recording.name, `${kind} ${what}, ${when}`));
    const cells = [when, words('pair', { of: kind, text: what }), outcome(recording), look].map((cell) => make('td', {}, cell));
    return make('tr', { title: recording.name }, ...cells);
  });
  setProperty(byId('recordings'), 'hidden', lines.length === 0);
  setText(byId('recordings-none'), lines.length === 0 ? words('recordings.none') : '');
  byId('recordings').tBodies[0].replaceChildren(...lines);
}

/** How a show ended, and how large its file is; of what is no show, or was not closed, nothing else is known. */
function outcome({ bytes, result, lost, missed_ticks: missed }) {
  if (result === undefined) return size(bytes);
  const faults = [lost > 0 && words('recordings.lost', { n: whole(lost) }), missed > 0 && words('recordings.missed', { n: whole(missed) })].filter(Boolean);
  return [endingName(result), ...(faults.length > 0 ? faults : [words('recordings.all')]), size(bytes)].join(', ');
}

/** 2026-01-31T19-00-00-show-coaster.mcap. */
function parts({ name, begun }) {
  const [, kind, what] = name.match(/^\d{4}-\d\d-\d\dT\d\d-\d\d-\d\d-([a-z]+)-(.*)\.mcap$/) ?? [null, '', name];
  const when = begun === null ? '' : dayAndTime(begun);
  return { when, kind: KINDS.includes(kind) ? words(`recordings.${kind}`) : kind, what };
}

const size = (bytes) => (bytes < 1e6 ? `${number(Math.ceil(bytes / 1000))} kB` : `${number(bytes / 1e6, 1)} MB`);
