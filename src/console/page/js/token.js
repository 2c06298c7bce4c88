// The token by which the server knows who asks: kept while the page is open, asked for when the server wants one. A link may
// bring it as `#token=…`: what is behind the # is never sent to a server, and it is taken out of the address bar at once.

import { byId, setProperty, setText } from './dom.js';
import { words } from './language.js';

const KEY = 'kinocue-token';
const IN_LINK = /^#token=([\w.~-]{1,256})$/;
const given = [];
let left = false;
let offered = null;

/** The token; null where none was given. */
export const token = () => sessionStorage.getItem(KEY);

/** Calls back when a token was given. */
export const onToken = (listener) => given.push(listener);

/**
 * The server does not know who showed that token. Whoever has given another one since is not asked, and whoever left the dialog only when
 * they press something.
 */
export function askForToken({ pressed, shown = token() }) {
  if (shown !== token() || (left && !pressed)) return;
  open(token() ? 'token.unknown' : 'token.required');
}

/** The server knows who asks, and they may not. */
export const askForAnother = () => open('token.more');

/** Keeps the token of the link that led here apart until the server is known to know it; says whether there was one. */
function takeFromLink() {
  const found = IN_LINK.exec(location.hash);
  if (!found) return false;
  history.replaceState(history.state, '', location.pathname + location.search);
  // One that serves is kept until another one is known to serve: no page of others may break the STOP of this one by a link.
  if (token() && byId('token').hidden) offered = found[1] === token() ? null : found[1];
  else sessionStorage.setItem(KEY, found[1]);
  return true;
}

/** The other token that a link brought, once; null where it brought none. */
export function takeOffered() {
  const taken = offered;
  offered = null;
  return taken;
}

/** Uses a token from now on; none where it is null. */
export function useToken(text) {
  if (text === null) sessionStorage.removeItem(KEY);
  else sessionStorage.setItem(KEY, text);
  used();
}

function used() {
  byId('token').hidden = true;
  left = false;
  for (const listener of given) listener();
}

// Before anything is asked: whoever asks imports this.
takeFromLink();

/** Opens the dialog. It leaves the rest of the page usable: STOP must stay in reach. */
function open(why) {
  const form = byId('token');
  setText(byId('token-why'), words(why));
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
    const typed = text.value.trim();
    text.value = '';
    useToken(typed);
  });
  byId('token-leave').addEventListener('click', () => {
    form.hidden = true;
    left = true;
  });
  byId('token-other').addEventListener('click', () => open('token.any'));
  byId('token-out').addEventListener('click', () => useToken(null));
  addEventListener('hashchange', () => takeFromLink() && used());
}
