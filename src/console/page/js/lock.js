// Show mode: a lock of this page that leaves STOP, PAUSE, RESUME, PARK and GO, so that no other press is made in the dark. A press
// locks; it takes a long one to unlock, by finger or key. It is kept as long as the page is open.

import { byId, setAttribute, setProperty } from './dom.js';
import { words } from './language.js';
import { say } from './press.js';

const KEY = 'kinocue-locked';
const HOLD_MS = 1500;
/** What cannot be pressed in show mode; what is hidden in it is in the style. */
const LOCKED = '.panel, .bar, #next-actions, #gravest, .foot';

let timer = null;
/** The press that unlocked has not ended: its end locks nothing. */
let isEnding = false;

const isLocked = () => sessionStorage.getItem(KEY) !== null;

/** Whether show mode keeps a button of the show from being pressed: the style hides it. */
export const isShut = (button) => isLocked() && getComputedStyle(button).visibility === 'hidden';

/** Makes the button work. */
export function startLock() {
  const button = byId('lock');
  setProperty(button, 'hidden', false);
  button.addEventListener('pointerdown', hold);
  button.addEventListener('keydown', (event) => ['Enter', ' '].includes(event.key) && !event.repeat && hold());
  for (const end of ['pointerup', 'pointerleave', 'pointercancel', 'keyup', 'blur']) button.addEventListener(end, letGo);
  // Holding is no call of a menu.
  button.addEventListener('contextmenu', (event) => event.preventDefault());
  button.addEventListener('click', () => {
    if (isEnding) isEnding = false;
    else if (isLocked()) say(button, words('lock.hold'));
    else turn(true);
  });
  showLock();
}

function hold() {
  // A second finger begins anew: of two, one would go on when both are off.
  clearTimeout(timer);
  isEnding = false;
  if (!isLocked()) return;
  setProperty(byId('lock'), 'className', 'lock held');
  timer = setTimeout(() => {
    isEnding = true;
    turn(false);
  }, HOLD_MS);
}

function letGo() {
  clearTimeout(timer);
  setProperty(byId('lock'), 'className', 'lock');
}

function turn(on) {
  letGo();
  if (on) sessionStorage.setItem(KEY, '');
  else sessionStorage.removeItem(KEY);
  showLock();
}

/** Shows it; a part of the page that the lost link has taken away stays away. */
export function showLock(_, link = 'live') {
  const locked = isLocked();
  document.documentElement.toggleAttribute('data-locked', locked);
  setAttribute(byId('lock'), 'aria-pressed', String(locked));
  const what = words(locked ? 'lock.hold' : 'lock.on');
  setAttribute(byId('lock'), 'aria-label', what);
  setProperty(byId('lock'), 'title', what);
  for (const part of document.querySelectorAll(LOCKED)) {
    setProperty(part, 'inert', locked || (link === 'lost' && part.classList.contains('live')));
  }
}
