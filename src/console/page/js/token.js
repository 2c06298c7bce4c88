// The token by which the server knows who asks: kept while the page is open, asked for when the server wants one.

import { byId, setProperty, setText } from './dom.js';

const KEY = 'kinocue-token';
const given = [];

/** The token; null where none was given. */
export const token = () => sessionStorage.getItem(KEY);

/** Calls back when a token was given. */
export const onToken = (listener) => given.push(listener);

/** Opens the dialog. It leaves the rest of the page usable: STOP must stay in reach. */
export function askForToken() {
  const form = byId('token');
  const why = token() ? 'The server does not know that token, or has forgotten it.' : 'This server wants a token.';
  setText(byId('token-why'), `${why} Its engineer has one for you.`);
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
    for (const listener of given) listener();
  });
}
