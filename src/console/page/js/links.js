// Serial links and the axes on them: is the port there, how often and how far ahead they play, how their drives do.

import { byId, make, onChange, setProperty, setText } from './dom.js';
import { healthOf, healthWord, mark } from './marks.js';
import { micros, number, whole } from './words.js';
import { words } from './language.js';
import { healthName } from './said.js';

const OPEN = { look: 'good', mark: 'disc', word: 'links.open' };
const GONE = { look: 'bad', mark: 'cross', word: 'links.gone' };

/** What is said of a link. */
const FIGURES = {
  'links.rate': ({ rate_hz: hz }) => `${number(hz, 1)} Hz`,
  'links.lead': ({ lead_ms: ms }) => `${number(ms)} ms`,
  'links.deviation': ({ deviation_mm: mm }) => (mm === null ? words('links.no-cue') : millimetres(mm)),
  'links.delay': ({ delay_p99_us: us }) => micros(us),
  'links.answered': ({ asked, answered }) => words('of', { n: whole(answered), all: whole(asked) }),
  'links.late': ({ late, stray }) => `${whole(late)}, ${whole(stray)}`,
};

/** What is said of an axis; a drive without a queue has none that waits or runs dry, and confirms nothing. */
const COLUMNS = {
  'links.queue': ({ queued }, confirms) => (confirms ? String(queued) : '–'),
  'links.dry': ({ dry }, confirms) => (confirms ? whole(dry) : '–'),
  'links.error': ({ error_mm: mm }) => millimetres(mm),
  'links.off-course': ({ off_course_mm: mm }) => millimetres(mm),
  'links.segments': (axis, confirms) => (confirms ? segments(axis) : words('links.unconfirmed', { n: whole(axis.unconfirmed) })),
  'links.temperature': ({ hot }) => words(hot ? 'links.hot' : 'links.cool'),
};

const millimetres = (mm) => `${number(mm, 2)} mm`;

function segments({ made, acked, refused, in_doubt: doubt }) {
  const bad = [[refused, 'links.refused'], [doubt, 'links.in-doubt']].filter(([count]) => count > 0);
  return [words('of', { n: whole(acked), all: whole(made) }), ...bad.map(([count, word]) => words(word, { n: whole(count) }))].join(', ');
}

let parts = [];

/** Shows them; the panel goes where the hall has none. */
export function showLinks(status) {
  if (!status) return;
  const { links = [], controllers } = status;
  setProperty(byId('links-panel'), 'hidden', links.length === 0);
  layOut(links.map(({ name, port, dialect, axes }) => ({ name, port, dialect, axes: axes.map(({ controller, axis }) => `${controller} a${axis}`) })));
  for (const [place, link] of links.entries()) showLink(parts[place], link, controllers);
}

const layOut = onChange((links) => {
  parts = links.map(build);
  byId('links').replaceChildren(...parts.map(({ all }) => all));
});

function build({ name, port, dialect, axes }) {
  const state = make('p', { className: 'link-state' });
  const figures = {};
  const list = make('dl', { className: 'controller-figures' });
  for (const label of Object.keys(FIGURES)) {
    figures[label] = make('dd');
    list.append(make('div', {}, make('dt', {}, words(label)), figures[label]));
  }
  const heads = ['links.axis', 'links.state', ...Object.keys(COLUMNS)].map((head) => make('th', { scope: 'col' }, words(head)));
  const lines = axes.map(axisOf);
  const table = make('table', { 'aria-label': words('links.axes', { name }) },
    make('thead', {}, make('tr', {}, ...heads)), make('tbody', {}, ...lines.map(({ row }) => row)));
  const all = make('div', { className: 'link' },
    make('h3', {}, `${name}, ${dialect}`), make('p', { className: 'quiet link-port' }, port), state, list, make('div', { className: 'scroll' }, table));
  return { all, state, figures, lines };
}

function axisOf(name) {
  const state = make('span', { className: 'grave' });
  const cells = Object.keys(COLUMNS).map(() => make('td'));
  const row = make('tr', {}, make('th', { scope: 'row' }, name), make('td', {}, state), ...cells);
  return { row, state, cells };
}

function showLink({ state, figures, lines }, link, controllers) {
  const port = link.fault === null ? OPEN : GONE;
  showMark(state, `link-state look-${port.look}`, port, link.fault === null ? words(port.word) : words('pair', { of: words(port.word), text: link.fault }));
  for (const [label, figure] of Object.entries(FIGURES)) setText(figures[label], figure(link));
  for (const [place, axis] of link.axes.entries()) {
    const { state: told, cells } = lines[place];
    const seat = controllers.find(({ name }) => name === axis.controller);
    const look = seat ? healthOf(seat) : { look: 'away', mark: 'what' };
    showMark(told, `grave look-${look.look}`, look, healthName(seat ? healthWord(seat) : 'unknown'));
    for (const [column, figure] of Object.values(COLUMNS).entries()) setText(cells[column], figure(axis, link.dialect === 'silvermax'));
  }
}

/** A mark and its word, made anew only where they are others. */
function showMark(element, className, { mark: shape }, word) {
  const said = `${shape} ${word}`;
  setProperty(element, 'className', className);
  if (element.dataset.said === said) return;
  element.dataset.said = said;
  element.replaceChildren(mark(shape), make('b', {}, word));
}
