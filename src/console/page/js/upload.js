// A cue file into the library: checked and proved by the server first, taken in or refused with every fault.

import { byId, make, setProperty, setText } from './dom.js';
import { upload } from './api.js';
import { ask, onPress } from './press.js';
import { holds, readLists } from './playlist.js';
import { words } from './language.js';

/** Faults that are listed; of a broken file there may be thousands. */
const FIRST = 20;
const LONGEST_ID = 64;

/** Makes the choice of a file and its button work. */
export function startUpload() {
  byId('upload-file').addEventListener('change', () => {
    showFaults([]);
    showButton();
  });
  onPress(byId('upload'), send);
  showButton();
}

const chosen = () => byId('upload-file').files[0];

/** The id that a file gets: its name in small letters, with a hyphen for whatever an id cannot have. */
export function idOf(name) {
  const stem = name.replace(/\.[^.]*$/, '').toLowerCase();
  return stem.replace(/[^a-z0-9_]+/g, '-').replace(/^-|-$/g, '').slice(0, LONGEST_ID);
}

function showButton() {
  const id = chosen() ? idOf(chosen().name) : '';
  setProperty(byId('upload'), 'disabled', id === '');
  setText(byId('upload'), words(id === '' ? 'upload' : holds(id) ? 'upload.replace' : 'upload.as', { id }));
}

async function send(button) {
  const file = chosen();
  const id = idOf(file.name);
  showFaults([]);
  const taken = await ask(button, words('upload.proved', { id }), async () => {
    try {
      return await upload(id, file);
    } catch (problem) {
      showFaults(problem.faults ?? []);
      throw Object.assign(problem, { faults: [] });
    }
  }, { long: true });
  if (!taken) return;
  byId('upload-file').value = '';
  await readLists(id);
  showButton();
}

function showFaults(faults) {
  const lines = faults.slice(0, FIRST);
  if (faults.length > FIRST) lines.push(words('and-more', { n: faults.length - FIRST }));
  byId('upload-faults').replaceChildren(...lines.map((fault) => make('li', {}, fault)));
}
