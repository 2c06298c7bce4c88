// All halls of a desk. What is heard comes from /api/v1/fleet/halls, twice a second; STOP goes to /api/v1/fleet/stop. Texts of halls become
// text here, never markup.

import { byId, make, setText } from './js/dom.js';

const EVERY_MS = 500;
const PATIENCE_MS = 1500;
const STOP_PATIENCE_MS = 8000;
const SILENT_S = 1.5;
const HANDS_OFF_MS = 3000;
const KEY = 'kinocue-token';

const tiles = new Map();
let heard = performance.now();
let everHeard = false;
let engine = true;
let touched = -Infinity;

const headers = (more = {}) => {
  const token = sessionStorage.getItem(KEY);
  return token ? { ...more, Authorization: `Bearer ${token}` } : more;
};

/** Asks the desk; its reply, or why there is none. */
async function ask(path, options, patience) {
  const response = await fetch(path, {
    cache: 'no-store', credentials: 'omit', redirect: 'error', signal: AbortSignal.timeout(patience), ...options, headers: headers(options.headers),
  });
  if (response.status === 401) byId('token').hidden = false;
  const reply = await response.json();
  if (!response.ok) throw new Error(`${reply.detail}; ${reply.remedy}`);
  return reply;
}

/** A tile without anything in it yet. */
function newTile(name) {
  const parts = {
    name: make('h2'), state: make('p', { className: 'state' }), why: make('p', { className: 'wide' }), film: make('p', { className: 'wide old' }), bar: make('progress', { className: 'wide old' }),
    figures: make('p', { className: 'wide figures old' }), warn: make('p', { className: 'wide warn old' }), age: make('p', { className: 'wide quiet' }), stop: make('button', { className: 'stop', type: 'button', 'aria-label': `STOP ${name}` }, 'STOP'),
  };
  parts.stop.addEventListener('click', () => stop([name], parts.stop));
  const { name: title, state, stop: button, why, film, bar, figures, warn, age } = parts;
  const tile = make('section', { className: 'hall', 'aria-label': name }, title, button, state, why, film, bar, figures, warn, age);
  return { tile, parts, told: null };
}

const clock = (seconds) => {
  const whole = Math.max(0, Math.floor(seconds));
  return `${String(Math.floor(whole / 60)).padStart(2, '0')}:${String(whole % 60).padStart(2, '0')}`;
};

function ageOf(seconds) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${seconds.toFixed(0)} s`;
  return seconds < 7200 ? `${(seconds / 60).toFixed(0)} min` : `${(seconds / 3600).toFixed(0)} h`;
}

/** Where a console is, if it is an address of the web and nothing else. */
function consoleOf(text) {
  return text && /^https?:\/\//.test(text) ? text : null;
}

function fill(one, hall) {
  const { parts, tile } = one;
  const { status, silent } = hall;
  one.told = hall;
  tile.className = `hall rank-${hall.rank}${silent ? ' silent' : ''}`;
  const title = status && status.hall && status.hall !== hall.name ? `${hall.name}, ${status.hall}` : hall.name;
  if (parts.name.textContent !== title) {
    const address = consoleOf(hall.console);
    const link = address ? make('a', { href: address, rel: 'noreferrer', target: '_blank' }, title) : title;
    parts.name.replaceChildren(link);
  }
  setText(parts.state, silent ? 'silent' : status.state);
  for (const part of [parts.film, parts.bar, parts.figures, parts.warn]) part.hidden = !status;
  if (!status) {
    setText(parts.why, 'Never heard. Check its link, its network and the engine.');
    return;
  }
  setText(parts.why, silent ? `Not heard now; it may play on. It was ${status.state}. Check its link and the network.` : `${status.cause}; next: ${status.next}`);
  const { show, seats } = status;
  parts.film.hidden = parts.bar.hidden = !show;
  if (show) {
    setText(parts.film, `${show.cue}, ${clock(show.position_s)} of ${clock(show.length_s)}`);
    Object.assign(parts.bar, { max: show.length_s || 1, value: show.position_s });
    parts.bar.setAttribute('aria-label', 'film');
  }
  const lost = seats.lost > 0 ? `, ${seats.lost} lost` : '';
  setText(parts.figures, `level ${Math.round(status.level * 100)} %, seats ${seats.taking_part} of ${seats.total}${lost}`);
  const [worst] = status.warnings;
  parts.warn.hidden = !worst || worst.severity === 'info';
  if (worst) {
    const more = status.warnings_total > 1 ? ` (and ${status.warnings_total - 1} more)` : '';
    setText(parts.warn, `${worst.controller ? `${worst.controller}: ` : ''}${worst.text}; ${worst.remedy}${more}`);
  }
}

function show({ desk, engine: reached, halls }) {
  engine = reached;
  setText(byId('desk'), desk);
  const main = byId('halls');
  const gone = new Set(tiles.keys());
  halls.forEach((hall, place) => {
    if (!tiles.has(hall.name)) tiles.set(hall.name, newTile(hall.name));
    gone.delete(hall.name);
    const one = tiles.get(hall.name);
    fill(one, hall);
    // A button does not move away from under a finger.
    if (main.children[place] !== one.tile && performance.now() - touched > HANDS_OFF_MS) main.insertBefore(one.tile, main.children[place] ?? null);
    if (!one.tile.isConnected) main.append(one.tile);
  });
  for (const name of gone) {
    tiles.get(name).tile.remove();
    tiles.delete(name);
  }
  const silent = halls.filter((hall) => hall.silent).length;
  const playing = halls.filter((hall) => !hall.silent && hall.status.moving).length;
  setText(byId('summary'), `${halls.length} halls, ${playing} in motion${silent ? `, ${silent} silent` : ''}`);
  document.title = `${silent ? `${silent} silent · ` : ''}${desk}: halls`;
}

/** Ages go on between replies; where none comes, everything here is old, and says so. */
function watch() {
  const since = (performance.now() - heard) / 1000;
  const lost = byId('lost');
  const away = everHeard ? `No answer from this desk for ${ageOf(since)}` : 'No answer from this desk';
  if (since > SILENT_S) setText(lost, `${away}: what is shown is old, and STOP here may not go out. Stop in the halls.`);
  else if (!engine) setText(lost, 'The engine of the fleet is not reached: no hall is heard, and STOP here does not go out. Stop in the halls.');
  lost.hidden = since <= SILENT_S && engine;
  for (const { tile, parts, told } of tiles.values()) {
    const age = told.age_s === null ? null : told.age_s + since;
    setText(parts.age, age === null ? 'never heard' : `heard ${ageOf(age)} ago`);
    if (since > SILENT_S) tile.classList.add('silent');
  }
}

async function read() {
  for (;;) {
    const begun = performance.now();
    try {
      show(await ask('/api/v1/fleet/halls', {}, PATIENCE_MS));
      [heard, everHeard] = [begun, true];
    } catch {
      // Said by the banner, once it lasts.
    }
    await new Promise((resolve) => setTimeout(resolve, EVERY_MS));
  }
}

/** Asks for a stop at once, and says what came of it in each hall. */
async function stop(halls, button) {
  const said = byId('said');
  said.hidden = false;
  said.textContent = `STOP sent to ${halls.join(', ')} …`;
  button.setAttribute('aria-busy', 'true');
  try {
    const body = JSON.stringify({ halls });
    const answers = await ask('/api/v1/fleet/stop', { method: 'POST', body, headers: { 'Content-Type': 'application/json' } }, STOP_PATIENCE_MS);
    said.textContent = answers.map(({ hall, done, text }) => `${hall}: ${done ? text : `NOT STOPPED: ${text}`}`).join('\n');
  } catch (error) {
    said.textContent = `NOT STOPPED: ${error.message}. Stop in the hall.`;
  } finally {
    button.removeAttribute('aria-busy');
  }
}

for (const kind of ['pointermove', 'pointerdown', 'focusin']) {
  byId('halls').addEventListener(kind, () => { touched = performance.now(); });
}
byId('stop-all').addEventListener('click', (event) => stop(['all'], event.currentTarget));
byId('token').addEventListener('submit', (event) => {
  event.preventDefault();
  sessionStorage.setItem(KEY, byId('token-text').value.trim());
  byId('token-text').value = '';
  byId('token').hidden = true;
});
setInterval(watch, 100);
read();
