// Warnings, gravest first, each with what to do.

import { byId, make, onChange, setProperty } from './dom.js';
import { mark } from './marks.js';
import { select } from './controller.js';
import { sentence } from './words.js';

/** How each severity is marked and called. */
export const SEVERITIES = {
  error: { look: 'bad', mark: 'peak', word: 'Error' },
  warning: { look: 'weak', mark: 'half', word: 'Warning' },
  info: { look: 'calm', mark: 'info', word: 'Note' },
};

/** Shows them; the panel goes where there are none. */
export function showWarnings(status) {
  if (!status) return;
  setProperty(byId('warnings-panel'), 'hidden', status.warnings.length === 0);
  show(status.warnings);
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
    button.addEventListener('click', () => {
      select(controller);
      byId('controller').scrollIntoView({ block: 'nearest' });
    });
    item.append(button);
  }
  return item;
}
