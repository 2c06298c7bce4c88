// The token by which the server knows who asks: kept while the page is open, asked for when the server wants one.

import { byId, setProperty, setText } from './dom.js';

const KEY = 'kinocue-token';
const given = [];
let left = false;

/** The token; null where none was given. */
export const token = () => sessionStorage.getItem(KEY);

/** Calls back when a token was given. */
export const onToken = (listener) => given.push(listener);

/** The server does not know who asks. Whoever left the dialog is asked again only when they press something. */
export function askForToken({ pressed }) {
  if (left && !pressed) return;
  open(token() ? 'The server does not know that token, or has forgotten it.' : 'This server wants a token.');
}

/** The server knows who asks, and they may not. */
export const askForAnother = () => open('That needs a token of somebody who may do more.');

/** Opens the dialog. It leaves the rest of the page usable: STOP must stay in reach. */
function open(why) {
  const form = byId('token');
  setText(byId('token-why'), `${why} The engineer of this hall has one for you.`);
  if (!form.hidden) return;
  setProperty(form, 'hidden', false);
  byId('token-text').focus();
}

/** Makes the dialog work. */
export function startToken() {
  const form = byId('token');
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    const text = byId('token-text');
    sessionStorage.setItem(KEY, text.value.trim());
    text.value = '';
    form.hidden = true;
    left = false;
    for (const listener of given) listener();
  });
  byId('token-leave').addEventListener('click', () => {
    form.hidden = true;
    left = true;
  });
}
