// The stream of events, for where a proxy or a browser takes no WebSocket. An EventSource cannot send a token, hence fetch and a reader.

import { headers } from './api.js';
import { hear } from './clock.js';
import { token } from './token.js';

/** Reads until it ends. */
export async function readEvents({ take, refuse, signal }) {
  const [begun, shown] = [performance.now(), token()];
  const response = await fetch('/api/v1/events', {
    headers: headers({ Accept: 'text/event-stream' }),
    cache: 'no-store',
    credentials: 'omit',
    redirect: 'error',
    signal,
  });
  hear(response.headers, begun);
  if (!response.ok) {
    refuse({ status: response.status, ...await response.json().catch(() => ({})) }, shown);
    return;
  }
  let text = '';
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    const events = (text + value.replaceAll('\r', '')).split('\n\n');
    text = events.pop();
    // Of several that came at once only the last is still true.
    const newest = events.map(dataOf).filter((data) => data !== '').pop();
    if (newest !== undefined) take(JSON.parse(newest));
  }
}

/** The data of an event: its data lines, joined. Comments have none. */
function dataOf(event) {
  const lines = event.split('\n').filter((line) => line.startsWith('data:'));
  return lines.map((line) => line.slice(line.startsWith('data: ') ? 6 : 5)).join('\n');
}
