// Warnings, gravest first, each with what to do.

import { byId, make, onChange, setProperty, setText } from './dom.js';
import { mark } from './marks.js';
import { isOut } from './seats.js';
import { hall } from './state.js';
import { disable, disableAll, select } from './controller.js';
import { counted, words } from './language.js';
import { remedyOf, textOf } from './said.js';
import { sentence, whole } from './words.js';

/** How each severity is marked and called. */
export const SEVERITIES = {
  error: { look: 'bad', mark: 'peak', word: 'severity.error' },
  warning: { look: 'weak', mark: 'half', word: 'severity.warning' },
  info: { look: 'calm', mark: 'info', word: 'severity.info' },
};

const FIRST = 4;
/** Controllers that a warning of several names. */
const NAMED = 8;
let all = false;
let lines = [];

/** Makes the rest of a long list appear, and go; leads from the gravest warning, which is always in view, to the list. */
export function startWarnings() {
  byId('gravest').addEventListener('click', () => byId('warnings-panel').scrollIntoView());
  byId('warnings-more').addEventListener('click', () => {
    all = !all;
    showWarnings(hall());
  });
}

/** Shows them; the panel goes where there are none. */
export function showWarnings(status) {
  if (!status) return;
  const { warnings } = status;
  const told = alike(warnings);
  setProperty(byId('warnings-panel'), 'hidden', told.length === 0);
  setText(byId('warnings-title'), titleOf(warnings));
  setProperty(byId('warnings-more'), 'hidden', told.length <= FIRST);
  setText(byId('warnings-more'), words(all ? 'warnings.fewer' : 'warnings.more', { n: told.length - FIRST }));
  const shown = all ? told : told.slice(0, FIRST);
  layOut(shown.map(({ id, severity, controllers }) => ({ id, severity, controllers: id === 'all-silent' ? outOf(hall()) : controllers, whole: id === 'all-silent' })));
  for (const [index, warning] of shown.entries()) {
    setText(lines[index].text, ` ${matter(warning)}`);
    setText(lines[index].remedy, sentence(remedyOf(warning)));
  }
  showGravest(warnings);
}

/** What is the matter with several controllers in the same words is told once. */
export function alike(warnings) {
  const told = new Map();
  for (const { controller = null, ...warning } of warnings) {
    const key = JSON.stringify([warning.severity, warning.text, warning.remedy, controller === null]);
    if (!told.has(key)) told.set(key, { ...warning, controllers: [] });
    if (controller !== null) told.get(key).controllers.push(controller);
  }
  return [...told.values()];
}

/** How many there are; where none of them warns of anything, they are notes. */
function titleOf(warnings) {
  const kind = warnings.every(({ severity }) => severity === 'info') ? 'notes' : 'warnings';
  return counted(kind, warnings.length, whole(warnings.length));
}

/** What is the matter, beginning with whose it is. */
function matter({ controllers, ...warning }) {
  const text = textOf(warning);
  if (controllers.length === 0) return sentence(text);
  const more = controllers.length > NAMED ? ` ${words('and-more', { n: controllers.length - NAMED })}` : '';
  return words('pair', { of: controllers.slice(0, NAMED).join(', ') + more, text });
}

function showGravest(warnings) {
  const grave = alike(warnings).filter(({ severity }) => severity !== 'info');
  setProperty(byId('gravest'), 'hidden', grave.length === 0);
  if (grave.length === 0) return;
  const { look, mark: name, word } = SEVERITIES[grave[0].severity] ?? SEVERITIES.warning;
  setProperty(byId('gravest'), 'className', `gravest live look-${look}`);
  showMark(name);
  setText(byId('gravest-words'), words('pair', { of: words(word), text: matter(grave[0]) }));
  setText(byId('gravest-more'), grave.length > 1 ? words('and-more', { n: grave.length - 1 }) : '');
}

const showMark = onChange((name) => byId('gravest-mark').replaceChildren(mark(name)));

// Words that change, as seconds do, are changed in place: a line made anew would go from under a finger.
const layOut = onChange((warnings) => {
  lines = warnings.map(line);
  byId('warnings').replaceChildren(...lines.map(({ item }) => item));
});

/** Takes out the one that it is about, or all of them at once. */
function out(controllers) {
  const [first, ...more] = controllers;
  const button = (text) => make('button', { type: 'button' }, text);
  if (more.length === 0) return disable(button(words('seat.disable', { which: first })), first);
  return disableAll(button(words('seat.disable-all', { n: controllers.length })), controllers);
}

const outOf = ({ controllers }) => controllers.filter(isOut).map(({ name }) => name);

function line({ id, severity, controllers, whole }) {
  const [first] = whole ? [] : controllers;
  const look = SEVERITIES[severity] ?? SEVERITIES.warning;
  const text = make('span');
  const remedy = make('span');
  const told = make('div', { className: 'warning-words' },
    make('p', {}, make('b', { className: 'severity' }, words(look.word)), text),
    make('p', { className: 'remedy' }, make('span', { className: 'off-screen' }, words('warnings.remedy')), remedy));
  const item = make('li', { className: `warning look-${look.look}` }, mark(look.mark), told);
  if (first) {
    const button = make('button', { type: 'button' }, words('warnings.show', { which: first }));
    button.addEventListener('click', () => select(first));
    item.append(button);
  }
  // Whoever stands up is brought down, not left there.
  if (severity === 'error' && id !== 'not-at-park' && controllers.length > 0) item.append(out(controllers));
  return { item, text, remedy };
}
