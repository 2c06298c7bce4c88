// How buttons are pressed: what they ask is sent once, and what came of it is said beside them.

import { byId, setAttribute, setText } from './dom.js';
import { Problem } from './api.js';
import { hall, watch } from './state.js';
import { sentence } from './words.js';
import { words } from './language.js';
import { stateName } from './said.js';

const SURE_WITHIN_MS = 3000;
const BOUNCE_MS = 250;
/** After how long it is said that what was asked is not done yet. */
const SLOW_MS = 1000;
/** How long it stays said what came of a press, and why it was not done. */
const DONE_MS = 8000;
const FAILED_MS = 30_000;

const timers = new Map();

/** Says something in the live region that belongs to an element; `failed` in the manner of a problem. */
export function say(near, text, failed = false) {
  const place = near.closest('[data-reply]');
  const reply = byId(place ? place.dataset.reply : 'show-reply');
  reply.classList.toggle('failed', failed);
  setText(reply, text);
  clearTimeout(timers.get(reply));
  timers.set(reply, setTimeout(() => forget(reply), failed ? FAILED_MS : DONE_MS));
  if (failed) obstacles.set(reply, obstacle(hall()));
  else obstacles.delete(reply);
}

function forget(reply) {
  setText(reply, '');
  reply.classList.remove('failed');
  obstacles.delete(reply);
}

// Why something was not done is over once the hall is another one.
const obstacles = new Map();
const obstacle = (status) => status && `${status.state} ${status.next} ${status.show?.sha256}`;
watch((status) => {
  for (const [reply, then] of obstacles) if (obstacle(status) !== then) forget(reply);
});

/**
 * Asks, and says what came of it beside the element that was pressed. Gives whether it was done. What takes its time, as a preflight does,
 * is `long`; all else can be pressed again after a second without an answer.
 */
export async function ask(near, what, request, { long = false } = {}) {
  setAttribute(near, 'aria-busy', 'true');
  say(near, `${sentence(what)} …`);
  const slow = setTimeout(() => {
    if (!long) near.removeAttribute('aria-busy');
    say(near, words('press.slow', { what: sentence(what) }), !long);
  }, SLOW_MS);
  try {
    const status = await request();
    const done = words('press.done', { what: sentence(what) });
    say(near, status?.state ? `${done}, ${stateName(status.state)}` : done);
    return true;
  } catch (error) {
    const problem = error instanceof Problem ? error.words : words('press.page', { why: error.message });
    say(near, words('press.failed', { what: sentence(what), why: sentence(problem) }), true);
    return false;
  } finally {
    clearTimeout(slow);
    near.removeAttribute('aria-busy');
  }
}

/** A button whose request is under way does not send another. */
export function onPress(button, action) {
  button.addEventListener('click', () => {
    if (button.disabled || button.hasAttribute('aria-busy')) return;
    action(button);
  });
}

/**
 * A button that moves seats: the first press asks, the second one within three seconds does it. The second press of a double
 * tap is no second thought and is left out; so is a key that is held down.
 */
export function onTwoPresses(button, { asks, label, action }) {
  let since = null;
  let timer = null;
  const relax = () => {
    clearTimeout(timer);
    since = null;
    button.classList.remove('sure');
    setText(label(), button.dataset.word);
  };
  button.dataset.word = label().textContent;
  button.addEventListener('keydown', (event) => event.repeat && event.preventDefault());
  button.addEventListener('blur', relax);
  onPress(button, () => {
    const now = performance.now();
    if (since === null) {
      since = now;
      button.classList.add('sure');
      setText(label(), asks);
      say(button, words('press.again', { what: button.dataset.word }));
      timer = setTimeout(() => {
        relax();
        say(button, '');
      }, SURE_WITHIN_MS);
    } else if (now - since >= BOUNCE_MS) {
      relax();
      action(button);
    }
  });
  return relax;
}
