// Tables: the last preflight, and the newest lines of the journal.

import { byId, make, onChange, setProperty, setText } from './dom.js';
import { change } from './api.js';
import { ask, onPress } from './press.js';
import { SEVERITIES, alike } from './warnings.js';
import { mark } from './marks.js';
import { remedyOf, textOf } from './said.js';
import { lasting, sentence } from './words.js';
import { timeOfDay } from './zone.js';
import { words } from './language.js';

/** Makes preflight run. */
export function startReports() {
  onPress(byId('preflight-run'), runPreflight);
}

/** Has every seat asked whether it is fit for a show. */
export const runPreflight = (button) => ask(button, words('preflight.title'), () => change('POST', 'preflight'), { long: true });

/** Shows both tables. */
export function showReports(status) {
  if (!status) return;
  showPreflight(status);
  showJournal({ journal: status.journal, zone: status.timezone });
}

function showPreflight({ preflight, controllers }) {
  const verdict = byId('preflight-verdict');
  setProperty(byId('preflight'), 'hidden', !preflight || preflight.findings.length === 0);
  if (!preflight) {
    setProperty(verdict, 'className', 'verdict');
    setText(verdict, words('preflight.never'));
    return;
  }
  setProperty(verdict, 'className', `verdict ${preflight.passed ? 'look-good' : 'look-bad'}`);
  const outcome = words(preflight.passed ? 'preflight.passed' : 'preflight.failed');
  const all = controllers.filter(({ health }) => health !== 'out').length;
  setText(verdict, words('preflight.answered', { outcome, n: preflight.answered, all, time: lasting(preflight.age_s) }));
  showFindings({ findings: preflight.findings, all });
}

const showFindings = onChange(({ findings, all }) => {
  const lines = alike(findings).map(({ severity, controllers, ...found }) => {
    const look = SEVERITIES[severity] ?? SEVERITIES.warning;
    const grave = make('span', { className: `grave look-${look.look}` }, mark(look.mark), words(look.word));
    return row([make('span', {}, grave, make('p', {}, whose(controllers, all))), make('span', {}, sentence(textOf(found)), remedy(sentence(remedyOf(found))))]);
  });
  byId('preflight').tBodies[0].replaceChildren(...lines);
});

const remedy = (text) => make('p', { className: 'remedy' }, make('span', { className: 'off-screen' }, words('warnings.remedy')), text);

function whose(controllers, all) {
  if (controllers.length === 0) return words('hall');
  return controllers.length === all && all > 1 ? words('preflight.all', { n: all }) : controllers.join(', ');
}

const showJournal = onChange(({ journal }) => {
  const lines = journal.map(({ at, who, what, result, times }) => {
    const came = result === 'done' ? words('journal.done') : result;
    const line = row([timeOfDay(at), who, what, times > 1 ? words('journal.times', { came, n: times }) : came]);
    line.classList.toggle('refused', result !== 'done');
    return line;
  });
  byId('journal').tBodies[0].replaceChildren(...lines);
});

const row = (cells) => make('tr', {}, ...cells.map((cell) => make('td', {}, cell)));
