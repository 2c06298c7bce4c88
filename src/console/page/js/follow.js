// The film that the hall follows: its timecode in large figures, how well it is known and by which source, why, and what to do.
// A hall that follows none shows nothing of it.

import { byId, onChange, setAttribute, setProperty, setText } from './dom.js';
import { addError, resizeErrors } from './error.js';
import { badge } from './headline.js';
import { filmLook, filmStateOf, mark } from './marks.js';
import { showSources } from './sources.js';
import { linkState } from './state.js';
import { clock, sentence, signed, span } from './words.js';
import { words } from './language.js';
import { filmCause, filmName, filmNext } from './said.js';

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
  showBadge(status);
  if (film === null) return;
  // A cue that does not follow it needs no more of it than that.
  byId('follow-panel').toggleAttribute('data-aside', status.show !== null && !film.leads);
  showTimecode(film);
  const state = filmStateOf(status);
  const look = filmLook(state);
  setProperty(byId('follow-state'), 'className', `follow-state look-${look.look}`);
  showMark(look.mark);
  setText(byId('follow-word'), filmName(state));
  setText(byId('follow-source'), film.source === null ? words('follow.no-source') : words('follow.by', { source: film.source }));
  setText(byId('follow-cause'), sentence(causeOf(film)));
  setText(byId('follow-next'), sentence(filmNext(film)));
  setText(byId('follow-apart'), apart(film));
  showSources(film);
  addError(link === 'live' ? film.error_ms : null);
}

/** What the source that leads says of it, or the first while none does. */
const causeOf = ({ source, sources, cause }) => sources.length === 0 ? cause : filmCause(sources.find((one) => one.source === source) ?? sources[0]);

const showMark = onChange((name) => byId('follow-mark').replaceChildren(mark(name)));

/** In view wherever the page is scrolled to. */
function showBadge(status) {
  const film = status?.film ?? null;
  if (film === null) return badge('follow-badge', '', 'away');
  const { source, error_ms: error } = film;
  const state = filmStateOf(status);
  const parts = [words('follow.badge', { state: filmName(state) }), source && source.split(':')[0], error !== null && signed(Number(error.toFixed(1)) || 0)];
  badge('follow-badge', parts.filter(Boolean).join(', '), filmLook(state).look, causeOf(film));
}

/** The label of the frame; of a film without labels its place in the cue. */
function showTimecode({ timecode, position_s: position }) {
  const labelled = timecode !== null;
  const known = labelled || position !== null;
  setText(byId('timecode'), labelled ? timecode : clock(position, 1, 3600));
  const what = labelled ? 'follow.timecode' : 'follow.position';
  setText(byId('timecode-of'), words(known ? what : 'follow.unknown'));
  setAttribute(byId('timecode'), 'data-known', String(known));
}

function apart({ leads, disagrees }) {
  if (disagrees !== null) {
    const { source, ahead_s: ahead } = disagrees;
    return words('follow.apart', { source, span: span(ahead) });
  }
  return leads ? '' : words('follow.not-led');
}
