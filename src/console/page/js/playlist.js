// The playlist with its entries and its next start; what the library holds, to be loaded.

import { byId, make, onChange, setProperty, setText } from './dom.js';
import { change, get } from './api.js';
import { ask, onPress, say } from './press.js';
import { onToken } from './token.js';
import { atIn, nextStart } from './starts.js';
import { clock, percent, sentence, signed } from './words.js';
import { words } from './language.js';

let cues = [];

/** Reads the lists and makes the buttons work. */
export function startPlaylist() {
  onPress(byId('playlist-load'), (button) => {
    const id = byId('playlists').value;
    if (id) ask(button, words('playlist.load', { id }), () => change('PUT', 'playlist', { id }), { long: true });
  });
  onPress(byId('playlist-drop'), (button) => ask(button, words('playlist.unload'), () => change('PUT', 'playlist', { id: null })));
  onPress(byId('cue-load'), loadCue);
  onPress(byId('lists-again'), () => readLists());
  byId('cues').addEventListener('change', showCueNote);
  onToken(() => readLists());
}

/** The cue that is chosen in the list; empty where there is none. */
export const chosenCue = () => byId('cues').value;

/** Loads it. */
export function loadCue(button) {
  const cue = chosenCue();
  // Only reading a cue shows its title and length, or its faults.
  if (cue) ask(button, words('load.cue', { cue }), () => change('POST', 'show/load', { cue }), { long: true }).then(() => readLists());
}

/** Whether the library has a cue of that id, as far as is known. */
export const holds = (id) => cues.some((cue) => cue.id === id);

/** Reads what playlists and cues there are, and chooses a cue where one is named. */
export async function readLists(cue) {
  try {
    const [playlists, library] = await Promise.all([get('playlists'), get('cues')]);
    cues = library;
    fill(byId('playlists'), playlists);
    fill(byId('cues'), cues);
    if (holds(cue)) byId('cues').value = cue;
    showCueNote();
  } catch (error) {
    say(byId('cues'), words('playlist.unread', { why: error.words ?? error.message }), true);
  }
}

function fill(list, entries) {
  const before = list.value;
  const options = entries.map((entry) => {
    const length = entry.length_s ? ` (${clock(entry.length_s, 0)})` : '';
    const failed = faultsOf(entry).length > 0 ? ` – ${words('playlist.faults')}` : '';
    return make('option', { value: entry.id }, `${entry.title ?? entry.id}${length}${failed}`);
  });
  list.replaceChildren(...options);
  if (entries.some((entry) => entry.id === before)) list.value = before;
  if (entries.length === 0) list.append(make('option', { value: '' }, words('figure.none')));
}

/** The faults of a playlist's file, or those that the proof of a cue against the hall's limits found. */
const faultsOf = (entry) => entry.faults ?? entry.proof?.faults ?? [];

function showCueNote() {
  const cue = cues.find((each) => each.id === byId('cues').value);
  setText(byId('cue-note'), cue ? faultsOf(cue).join('; ') : '');
}

/** Shows the playlist. */
export function showPlaylist(status) {
  if (!status) return;
  const { playlist } = status;
  const start = nextStart(status);
  const next = start?.lapsing ?? (start ? words('playlist.starts', { at: start.at }) : words('playlist.no-start'));
  setText(byId('playlist-head'), playlist ? `${playlist.title}. ${sentence(next)}` : words('playlist.none'));
  setProperty(byId('playlist-drop'), 'disabled', !playlist);
  const loaded = playlist?.entries[playlist.current];
  const note = loaded && loaded.cue === status.show?.cue ? loaded.note : null;
  setProperty(byId('entry-note'), 'hidden', !note);
  setText(byId('entry-note'), note ?? '');
  setProperty(byId('entry-note'), 'title', note ?? '');
  // Their countdowns change in place: a button made anew would go from under a finger.
  const still = playlist?.entries.map((entry) => ({ ...entry, starts_in_s: null }));
  showEntries(playlist ? { entries: still, current: playlist.current, cue: status.show?.cue } : { entries: [], current: -1 });
  for (const [index, place] of byId('entries').querySelectorAll('.starts-at').entries()) {
    const { at, starts_in_s: wait } = playlist.entries.filter((entry) => entry.at)[index];
    setText(place, words('entry.at', { at: atIn(at, wait) }));
  }
}

// Another cue may have been loaded by hand since.
const showEntries = onChange(({ entries, current, cue }) => {
  const isLoaded = (entry, index) => index === current && entry.cue === cue;
  byId('entries').replaceChildren(...entries.map((entry, index) => entryLine(entry, index, isLoaded(entry, index))));
});

function entryLine(entry, index, isLoaded) {
  const title = entry.title ?? entry.cue;
  const facts = [
    clock(entry.length_s, 0),
    entry.preset,
    entry.level !== null && words('entry.level', { level: percent(entry.level) }),
    entry.trim_ms !== null && words('trim.to', { trim: signed(entry.trim_ms) }),
    words(entry.then === 'go' ? 'entry.then-itself' : 'entry.then-go'),
  ].filter(Boolean);
  const told = make('span', { className: 'entry-words' }, make('b', {}, title), make('span', { className: 'quiet' }, facts.join(', ')));
  if (entry.at) told.append(make('span', { className: 'starts-at' }));
  if (entry.note) told.append(make('span', { className: 'note-words' }, entry.note));
  if (isLoaded) {
    return make('li', { className: 'entry current', 'aria-current': 'true' }, told, make('span', { className: 'loaded' }, words('entry.loaded')));
  }
  const button = make('button', { type: 'button', 'aria-label': words('entry.select-as', { title }) }, words('entry.select'));
  onPress(button, () => ask(button, words('entry.select-as', { title }), () => change('POST', 'playlist/select', { entry: index }), { long: true }));
  return make('li', { className: 'entry' }, told, button);
}
