// Who is logged in: the name of the token, and what it permits; and who a link would have it be.

import { byId, setProperty, setText } from './dom.js';
import { get, isKnown } from './api.js';
import { say } from './press.js';
import { said, words } from './language.js';
import { onToken, takeOffered, token, useToken } from './token.js';

/** Asks again whenever another token was given. */
export const startWho = () => onToken(readWho);

/** Asks the server who we are to it, after it was asked whether it knows the other token of a link. */
export async function readWho() {
  const offered = takeOffered();
  const isTaken = offered !== null && await isKnown(offered);
  // Whoever hears of it reads all anew, and this too.
  if (isTaken) useToken(offered);
  const me = await get('who').then(({ name, role }) => words('who', { name, role: said('role', { code: role }, role) }), () => '');
  for (const id of ['who', 'who-foot']) setText(byId(id), me);
  setProperty(byId('who'), 'title', me);
  setProperty(byId('token-out'), 'hidden', !token());
  if (offered !== null) say(byId('show-reply'), words(isTaken ? 'token.by-link' : 'token.link-bad', { who: me }), !isTaken);
}
