// Who is logged in: the name of the token, and what it permits.

import { byId, setProperty, setText } from './dom.js';
import { get } from './api.js';
import { said, words } from './language.js';
import { onToken } from './token.js';

/** Asks again whenever another token was given. */
export const startWho = () => onToken(readWho);

/** Asks the server who we are to it. */
export async function readWho() {
  try {
    const { name, role } = await get('who');
    const me = words('who', { name, role: said('role', { code: role }, role) });
    setText(byId('who'), me);
    setProperty(byId('who'), 'title', me);
  } catch {
    setText(byId('who'), '');
  }
}
