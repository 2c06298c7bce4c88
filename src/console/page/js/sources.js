// The sources of the film in their ranking, and which of them is followed: as the ranking says, or as a person chose. Another
// source may say another place, to which the seats move: so a press asks, and a second one does it.

import { byId, make, onChange, setAttribute, setProperty, setText } from './dom.js';
import { change } from './api.js';
import { filmLook, mark } from './marks.js';
import { ask, onTwoPresses } from './press.js';
import { filmCause, filmName } from './said.js';
import { number, plus, sentence, whole } from './words.js';
import { words } from './language.js';

let lines = [];

/** Shows them. */
export function showSources({ sources, source: leading, chosen }) {
  layOut(sources.map(({ source }) => source));
  for (const [place, line] of lines.entries()) showLine(line, sources[place], { leading, chosen });
  showPressed(byId('by-rank'), chosen === null);
}

/** Makes the button for the ranking work. */
export function startSources() {
  asksTwice(byId('by-rank'), words('sources.follow-rank'), null);
}

const layOut = onChange((names) => {
  lines = names.map(lineOf);
  byId('sources').replaceChildren(...lines.map(({ item }) => item));
});

function lineOf(name) {
  const picture = make('span');
  const word = make('b');
  const figures = make('span', { className: 'quiet source-figures' });
  const cause = make('span', { className: 'quiet' });
  const button = make('button', { type: 'button', 'aria-label': words('sources.follow', { name }) }, words('sources.use'));
  asksTwice(button, words('sources.follow', { name }), name);
  const head = make('p', {}, picture, word, ` ${name}`);
  const item = make('li', { className: 'source' }, make('div', { className: 'source-words' }, head, figures, cause), button);
  return { item, picture, word, figures, cause, button, shape: '' };
}

function asksTwice(button, what, source) {
  const action = () => ask(button, what, () => change('PUT', 'sync/source', { source }));
  onTwoPresses(button, { asks: words('sure'), label: () => button, action });
}

function showLine(line, source, { leading, chosen }) {
  const look = filmLook(source.state);
  const leads = source.source === leading;
  setProperty(line.item, 'className', `source look-${look.look}${leads ? ' leads' : ''}`);
  if (line.shape !== look.mark) {
    line.shape = look.mark;
    line.picture.replaceChildren(mark(look.mark));
  }
  setText(line.word, leads ? words('sources.leads', { state: filmName(source.state) }) : `${filmName(source.state)}:`);
  setText(line.figures, figuresOf(source));
  setText(line.cause, source.state === 'locked' && source.may_lead ? '' : sentence(filmCause(source)));
  showPressed(line.button, source.source === chosen);
}

function showPressed(button, pressed) {
  setAttribute(button, 'aria-pressed', String(pressed));
}

function figuresOf({ rate_ppm: rate, sigma_ms: sigma, level_dbfs: level, dropouts, rejected, jumps, may_lead: mayLead, state }) {
  const figures = [
    level === null ? null : words('sources.level', { db: number(level) }),
    words('sources.dropouts', { n: whole(dropouts) }),
    rate === null ? null : `${plus(rate)}${number(rate)} ppm`,
    sigma === null ? null : `σ ${number(sigma, 2)} ms`,
    jumps === 0 ? null : words('sources.jumps', { n: whole(jumps) }),
    rejected === 0 ? null : words('sources.rejected', { n: whole(rejected) }),
    state === 'locked' && !mayLead ? words('sources.coarse') : null,
  ];
  return figures.filter((figure) => figure !== null).join(', ');
}
