// A recording as a picture: one sentence, then what a seat was asked, sent and measured. The server draws it.

import { byId, make, setProperty, setText } from './dom.js';
import { get } from './api.js';
import { words } from './language.js';

let shown = { name: null, seat: null };
let url = null;

/** Makes the choice of the seat and the button work. */
export function startPicture() {
  byId('picture-seat').addEventListener('change', ({ target }) => draw(shown.name, target.value));
  byId('picture-large').addEventListener('click', ({ currentTarget: button }) => {
    const large = byId('picture').classList.toggle('large');
    button.setAttribute('aria-pressed', large);
  });
  byId('picture-close').addEventListener('click', close);
}

/** Shows the recording of that file; of its seats one that a mark names, else that fell out, else the one that was held back farthest. */
export function showPicture(name, title) {
  setText(byId('picture-title'), title);
  setProperty(byId('picture-panel'), 'hidden', false);
  byId('picture-title').focus({ preventScroll: true });
  draw(name, null);
}

async function draw(name, seat) {
  const mine = { name, seat };
  shown = mine;
  setText(byId('picture-sentence'), words('picture.drawing'));
  try {
    const query = seat === null ? '' : `?seat=${encodeURIComponent(seat)}`;
    const picture = await get(`recordings/${encodeURIComponent(name)}/picture${query}`);
    if (shown === mine) take(picture);
  } catch (error) {
    if (shown !== mine) return;
    setProperty(byId('picture'), 'hidden', true);
    setText(byId('picture-sentence'), words('picture.failed', { why: error.words ?? error.message }));
  }
}

function take({ title, sentence, seat, seats, svg }) {
  setText(byId('picture-sentence'), sentence);
  byId('picture-seat').replaceChildren(...seats.map((each) => make('option', { value: each, selected: each === seat }, each)));
  // As an image it neither runs nor loads anything, whatever is in it.
  forget();
  url = URL.createObjectURL(new Blob([svg], { type: 'image/svg+xml' }));
  const image = byId('picture');
  // Only now is the page long enough for all of it.
  image.onload = () => byId('picture-panel').scrollIntoView({ block: 'start' });
  image.src = url;
  image.alt = `${title}. ${sentence}`;
  image.hidden = false;
}

function close() {
  shown = { name: null, seat: null };
  forget();
  byId('picture').removeAttribute('src');
  setProperty(byId('picture'), 'hidden', true);
  setProperty(byId('picture-panel'), 'hidden', true);
}

function forget() {
  if (url !== null) URL.revokeObjectURL(url);
  url = null;
}
