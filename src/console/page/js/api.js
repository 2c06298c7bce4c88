// Requests to the server: with token, key against repeats, and the time at which they were sent.

import { sentAt, hear } from './clock.js';
import { askForAnother, askForToken, token } from './token.js';
import { said, words } from './language.js';

const PATIENCE_MS = 65_000; // the hall may take 60 s over a cue of two hours
const UPLOAD_MS = 600_000; // it is written, checked and proved, beside a show with what time that leaves
const ROOT = '/api/v1/';
/** Changes under way at once at the most: of the six connections that a browser has to a server, for all its pages, some must be free for STOP. */
const CHANGES = 3;

let changing = 0;
let reading = Promise.resolve();

/** Why something was not done, as the server or the browser says. */
export class Problem extends Error {
  constructor({ status = 0, code = '', why = '', detail, remedy, faults = [] }) {
    super(detail);
    Object.assign(this, { status, code, why, detail, remedy, faults });
  }

  /** In one line. */
  get words() {
    const { code, why, detail, remedy } = this;
    const kind = said('problem', { code }, null);
    const what = said('refusal', { code: why }, kind === null ? detail : words('pair', { of: kind, text: detail }));
    const faults = this.faults.length > 0 ? ` (${this.faults.join('; ')})` : '';
    return `${what}${faults}${remedy ? `; ${said('refusal-remedy', { code: why }, remedy)}` : ''}`;
  }
}

/** The headers that every request has. */
export function headers(more = {}) {
  const bearer = token();
  return bearer ? { ...more, Authorization: `Bearer ${bearer}` } : more;
}

/** A key that no other request has. Made of random bytes, since `randomUUID` is there on secure origins alone. */
function key() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
}

/** Reads, one after the other. */
export function get(path) {
  const reply = reading.then(() => request('GET', path, undefined, {}, PATIENCE_MS));
  reading = reply.catch(() => {});
  return reply;
}

/** Asks for a change; the reply is the status that it led to. */
export const change = (method, path, body = {}) => inTurn(() => send(method, path, body, key(), PATIENCE_MS));

/** Sends a cue file to the library; the reply is what the library knows of it then. */
export function upload(id, file) {
  const type = { 'Content-Type': 'application/byte-stream' };
  return inTurn(() => request('PUT', `cues/${id}`, file, type, UPLOAD_MS));
}

async function inTurn(request) {
  if (changing >= CHANGES) {
    throw new Problem({ detail: words('api.busy', { n: CHANGES }), remedy: words('api.busy.remedy') });
  }
  changing += 1;
  try {
    return await request();
  } finally {
    changing -= 1;
  }
}

/** Sends a stop, which waits behind nothing and is done each time that it comes. */
export const sendStop = (patience) => send('POST', 'show/stop', {}, key(), patience);

/** Why a plain STOP would not be taken now; null where it would be. */
export async function whyNoStop(patience) {
  try {
    await request('GET', 'who', undefined, {}, patience);
    return null;
  } catch (error) {
    // With a token that is no more, whoever needs none may stop all the same.
    return error.status > 0 && token() && await isKnown(null, patience) ? null : error;
  }
}

/** Whether the server knows whoever shows that token, or none. */
export function isKnown(shown, patience = PATIENCE_MS) {
  const asked = { cache: 'no-store', credentials: 'omit', redirect: 'error', signal: AbortSignal.timeout(patience), headers: shown === null ? {} : { Authorization: `Bearer ${shown}` } };
  return fetch(`${ROOT}who`, asked).then(({ ok }) => ok, () => false);
}

function send(method, path, body, repeatOf, patience) {
  const more = {
    'Content-Type': 'application/json',
    'Idempotency-Key': repeatOf,
    'X-Kinocue-Sent': String(sentAt()),
  };
  return request(method, path, JSON.stringify(body), more, patience);
}

async function request(method, path, body, more, patience) {
  const [before, shown] = [performance.now(), token()];
  let response;
  let text;
  try {
    response = await fetch(ROOT + path, {
      method,
      body,
      headers: headers(more),
      cache: 'no-store',
      credentials: 'omit',
      redirect: 'error',
      signal: AbortSignal.timeout(patience),
    });
    hear(response.headers, before);
    text = await response.text();
  } catch (error) {
    throw unreachable(error, patience);
  }
  const reply = parsed(text);
  if (response.ok) return reply;
  if (response.status === 401) askForToken({ pressed: method !== 'GET', shown });
  if (reply.code === 'role') askForAnother();
  throw new Problem({
    status: response.status,
    detail: words('api.replied', { status: response.status }),
    remedy: words('api.replied.remedy'),
    ...reply,
  });
}

function unreachable(error, patience) {
  if (error.name === 'TimeoutError') {
    return new Problem({ detail: words('api.late', { s: patience / 1000 }), remedy: words('api.late.remedy') });
  }
  return new Problem({ detail: words('api.away'), remedy: words('api.away.remedy') });
}

function parsed(text) {
  try {
    return JSON.parse(text) ?? {};
  } catch {
    return {};
  }
}
