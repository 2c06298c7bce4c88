// The film that the hall follows: its timecode in large figures, how well it is known and by which source, why, and what to do.
// A hall that follows none shows nothing of it.

import { byId, onChange, setAttribute, setProperty, setText } from './dom.js';
import { addError, resizeErrors } from './error.js';
import { badge } from './headline.js';
import { filmLook, mark } from './marks.js';
import { showSources } from './sources.js';
import { linkState } from './state.js';
import { clock, sentence, signed, span } from './words.js';

const AGE_MS = 1000;

/** Keeps the curve as wide as its place, and has it grow old where nothing is heard any more. */
export function startFollow() {
  setInterval(() => linkState() !== 'live' && addError(null), AGE_MS);
  new ResizeObserver(resizeErrors).observe(byId('error-curve'));
}

/** Shows the film, and takes its error for the curve. */
export function showFollow(status, link) {
  const film = status?.film ?? null;
  setProperty(byId('follow-panel'), 'hidden', film === null);
  showBadge(film);
  if (film === null) return;
  showTimecode(film);
  const look = filmLook(film.state);
  setProperty(byId('follow-state'), 'className', `follow-state look-${look.look}`);
  showMark(look.mark);
  setText(byId('follow-word'), film.state);
  setText(byId('follow-source'), film.source === null ? 'no source leads' : `by ${film.source}`);
  setText(byId('follow-cause'), sentence(film.cause));
  setText(byId('follow-next'), sentence(film.next));
  setText(byId('follow-apart'), apart(film));
  showSources(film);
  addError(link === 'live' ? film.error_ms : null);
}

const showMark = onChange((name) => byId('follow-mark').replaceChildren(mark(name)));

/** In view wherever the page is scrolled to. */
function showBadge(film) {
  if (film === null) return badge('follow-badge', '', 'away');
  const { state, source, error_ms: error } = film;
  const words = [`film ${state}`, source && source.split(':')[0], error !== null && signed(Number(error.toFixed(1)))];
  badge('follow-badge', words.filter(Boolean).join(', '), filmLook(state).look, film.cause);
}

/** The label of the frame; of a film without labels its place in the cue. */
function showTimecode({ timecode, position_s: position }) {
  const labelled = timecode !== null;
  const known = labelled || position !== null;
  setText(byId('timecode'), labelled ? timecode : clock(position, 1, 3600));
  const what = labelled ? 'timecode of the film' : 'position in the cue; the source has no timecode';
  setText(byId('timecode-of'), known ? what : 'the position of the film is unknown');
  setAttribute(byId('timecode'), 'data-known', String(known));
}

function apart({ leads, disagrees }) {
  if (disagrees !== null) {
    const { source, ahead_s: ahead } = disagrees;
    return `${source} says ${span(ahead)}: select the right one.`;
  }
  return leads ? '' : 'The loaded show does not follow it.';
}
