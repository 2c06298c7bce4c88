// Warnings, gravest first, each with what to do.

import { byId, make, onChange, setProperty, setText } from './dom.js';
import { mark } from './marks.js';
import { hall } from './state.js';
import { select } from './controller.js';
import { sentence } from './words.js';

/** How each severity is marked and called. */
export const SEVERITIES = {
  error: { look: 'bad', mark: 'peak', word: 'Error' },
  warning: { look: 'weak', mark: 'half', word: 'Warning' },
  info: { look: 'calm', mark: 'info', word: 'Note' },
};

const FIRST = 4;
let all = false;

/** Makes the rest of a long list appear, and go. */
export function startWarnings() {
  byId('warnings-more').addEventListener('click', () => {
    all = !all;
    showWarnings(hall());
  });
}

/** Shows them; the panel goes where there are none. */
export function showWarnings(status) {
  if (!status) return;
  const { warnings } = status;
  setProperty(byId('warnings-panel'), 'hidden', warnings.length === 0);
  setText(byId('warnings-title'), warnings.length === 1 ? '1 warning' : `${warnings.length} warnings`);
  setProperty(byId('warnings-more'), 'hidden', warnings.length <= FIRST);
  setText(byId('warnings-more'), all ? 'Only the gravest' : `Show ${warnings.length - FIRST} more`);
  show(all ? warnings : warnings.slice(0, FIRST));
}

const show = onChange((warnings) => byId('warnings').replaceChildren(...warnings.map(line)));

function line({ severity, controller, text, remedy }) {
  const look = SEVERITIES[severity] ?? SEVERITIES.warning;
  const words = make('div', { className: 'warning-words' },
    make('p', {}, make('b', { className: 'severity' }, look.word), ` ${sentence(text)}`),
    make('p', { className: 'remedy' }, make('span', { className: 'off-screen' }, 'What to do: '), sentence(remedy)));
  const item = make('li', { className: `warning look-${look.look}` }, mark(look.mark), words);
  if (controller) {
    const button = make('button', { type: 'button' }, `Show ${controller}`);
    button.addEventListener('click', () => select(controller));
    item.append(button);
  }
  return item;
}
