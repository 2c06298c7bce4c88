// Where the film is: the position in large figures, and a bar on which a place to seek to is chosen. Choosing moves nothing:
// the seek is a press of its own.

import { byId, make, onChange, setAttribute, setProperty, setText } from './dom.js';
import { change } from './api.js';
import { ask, onPress, say } from './press.js';
import { keepInView, onView, startTimeline, view } from './timeline.js';
import { hall } from './state.js';
import { clock, number, percent } from './words.js';
import { atIn, nextStart } from './starts.js';
import { said, words } from './language.js';

const ON = ['waiting', 'joining', 'playing', 'holding', 'paused'];
const MAY_SEEK = ['armed', 'joining', 'playing', 'holding', 'paused'];
/** A place that was chosen and left alone is forgotten, so that the bar follows the film again. */
const FORGET_MS = 15_000;
let chosen = null;
let timer = null;

/** Makes the bar work. */
export function startFilm() {
  const bar = byId('seek');
  bar.addEventListener('input', () => choose(Number(bar.value)));
  for (const step of [byId('seek-back'), byId('seek-on')]) {
    onPress(step, () => choose((chosen ?? 0) + Number(step.dataset.step)));
  }
  onPress(byId('seek-leave'), leave);
  startTimeline();
  onView(() => hall() && showFilm(hall()));
  onPress(byId('seek-go'), async (button) => {
    const at = chosen;
    if (await ask(button, words('seek.to', { at: clock(at) }), () => change('POST', 'show/seek', { position_s: at }))) leave();
  });
}

function choose(position) {
  const show = hall()?.show;
  if (!show) return;
  chosen = Math.min(Math.max(position, 0), show.length_s);
  clearTimeout(timer);
  timer = setTimeout(leave, FORGET_MS);
  showFilm(hall());
}

function leave() {
  clearTimeout(timer);
  chosen = null;
  if (hall()) showFilm(hall());
}

/** Shows the position, what is left, what is loaded and what comes next. */
export function showFilm(status) {
  if (!status) return;
  const show = status.show;
  setText(byId('film-title'), show ? titleOf(show, status.state) : words('film.none'));
  setText(byId('film-next'), nextOf(status));
  setText(byId('position'), show ? clock(show.position_s, 1, show.length_s) : '–');
  setText(byId('remaining'), show ? `−${clock(Math.max(show.length_s - show.position_s, 0), 0)}` : '');
  const maySeek = show !== null && MAY_SEEK.includes(status.state);
  if (!maySeek && chosen !== null) {
    chosen = null;
    say(byId('seek'), '');
  }
  showBar(show, maySeek);
  showMargins(show?.margins ?? []);
  setProperty(byId('seek-ask'), 'hidden', chosen === null);
  if (chosen !== null) setText(byId('seek-go'), words('seek.go', { at: clock(chosen) }));
}

/** What is loaded and how long it is; before it starts, with how long the seats take to get onto it. */
function titleOf(show, state) {
  const first = state === 'armed' && show.join_s > 0 ? `${words('film.first-move', { s: number(show.join_s, 1) })}: ` : '';
  return `${first}${show.title ?? show.cue}, ${clock(show.length_s, 0)}`;
}

/** The entry of the playlist that comes next, and when. */
function nextOf(status) {
  const { playlist, show, state } = status;
  if (!playlist) return '';
  const { entries, current } = playlist;
  const isLoaded = show?.cue === entries[current]?.cue;
  const start = nextStart(status);
  if (isLoaded && !ON.includes(state)) return start ? words(start.armed && !start.lapsing ? 'film.starts' : 'film.starts-if-armed', { at: start.at }) : '';
  const next = entries[current + 1];
  if (!next) return isLoaded ? words('film.last') : '';
  const title = next.title ?? next.cue;
  const how = entries[current].then === 'go' ? 'film.then-itself' : next.at ? 'film.then-at' : 'film.then-go';
  return words(how, { title, at: next.at && atIn(next.at, next.starts_in_s) });
}

function showBar(show, maySeek) {
  const bar = byId('seek');
  const at = chosen ?? (show ? Math.max(show.position_s, 0) : 0);
  keepInView(at);
  const [from, to] = view();
  setProperty(bar, 'disabled', !maySeek);
  setProperty(bar, 'min', String(from));
  setProperty(bar, 'max', String(to));
  setProperty(bar, 'value', String(Math.round(at * 10) / 10));
  setAttribute(bar, 'aria-valuetext', clock(at));
  bar.style.setProperty('--part', String(show ? Math.min(Math.max((show.position_s - from) / (to - from), 0), 1) : 0));
}

/** What the cue leaves of the limits; a press chooses the place where it leaves least. */
const showMargins = onChange((margins) => {
  const parts = margins.map(({ of, axis, part, at_s: at }) => {
    const what = said('margin', { code: of }, of);
    const button = make('button', { type: 'button' }, make('span', { className: 'quiet' }, what), make('b', {}, percent(part)));
    setAttribute(button, 'aria-label', words('margins.spoken', { what, part: percent(part), axis: `a${axis}`, at: clock(at) }));
    setProperty(button, 'title', `a${axis}, ${clock(at)}`);
    onPress(button, () => MAY_SEEK.includes(hall()?.state) && choose(at));
    return button;
  });
  byId('margins').replaceChildren(...parts);
  setProperty(byId('margins-title'), 'hidden', parts.length === 0);
});
