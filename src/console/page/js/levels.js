// Levels of the hall and of each row, effects, presets: how much of the cue the seats make.

import { byId, make, onChange, setAttribute, setProperty, setText } from './dom.js';
import { change } from './api.js';
import { ask, onPress } from './press.js';
import { percent, titled } from './words.js';
import { words } from './language.js';

const STEP = 5;
/** A level is sent when it has been left alone for so long, so that a drag is one change. */
const QUIET_MS = 300;
/** After a reply the hall's own level is shown again, once it had the time to arrive. */
const SETTLE_MS = 400;

const rulers = new Map();

/** Shows levels, effects and presets. */
export function showLevels(status) {
  if (!status) return;
  const { levels, show, presets } = status;
  showRulers([...new Set(status.controllers.map(({ row }) => row).filter((row) => row in levels.rows))]);
  rulers.get('motion').show(levels.motion);
  rulers.get('vibration').show(levels.vibration);
  for (const [row, level] of Object.entries(levels.rows)) rulers.get(`row ${row}`)?.show(level);
  showRows(levels.rows);
  const used = show?.effects ?? [];
  showEffects([...new Set([...Object.keys(levels.effects), ...used])].sort());
  for (const button of byId('effects').children) {
    const name = button.dataset.effect;
    const on = levels.effects[name] ?? true;
    setAttribute(button, 'aria-checked', String(on));
    setText(button.lastChild, words(on ? 'levels.on' : 'levels.off') + (show && !used.includes(name) ? `, ${words('levels.unused')}` : ''));
  }
  showPresets(presets);
}

const showRulers = onChange((rows) => {
  rulers.clear();
  byId('levels').replaceChildren(
    ruler('motion', words('levels.motion'), (value) => ({ motion: value })),
    ruler('vibration', words('levels.vibration'), (value) => ({ vibration: value })),
  );
  byId('row-levels').replaceChildren(...rows.map((row) => ruler(`row ${row}`, words('row', { row }), (value) => ({ rows: { [row]: value } }))));
  setProperty(byId('rows'), 'hidden', rows.length === 0);
});

/** The rows are folded away; which of them make less is in view all the same. */
function showRows(levels) {
  const less = Object.entries(levels).filter(([, level]) => level < 1).map(([row, level]) => `${row} ${percent(level)}`);
  setText(byId('rows-words'), less.length > 0 ? less.join(', ') : words('levels.all', { level: percent(1) }));
}

/** A slider with steps at its ends; it shows the hall's level, but never pulls away from under a finger. */
function ruler(name, title, body) {
  const id = `level-${name.replace(/[^A-Za-z0-9]/g, '-')}`;
  const slider = make('input', { type: 'range', id, min: '0', max: '100', step: '1' });
  const value = make('output', { className: 'figure', 'for': id });
  let timer = null;
  let busy = false;
  const show = () => {
    setText(value, percent(slider.value / 100));
    setAttribute(slider, 'aria-valuetext', percent(slider.value / 100));
    slider.style.setProperty('--part', String(slider.value / 100));
  };
  const send = async () => {
    timer = null;
    busy = true;
    const wanted = Number(slider.value) / 100;
    await ask(slider, `${title} ${percent(wanted)}`, () => change('PUT', 'levels', body(wanted)));
    setTimeout(() => { busy = timer !== null; }, SETTLE_MS);
  };
  const later = () => {
    show();
    clearTimeout(timer);
    timer = setTimeout(send, QUIET_MS);
  };
  slider.addEventListener('input', later);
  const stepper = (step) => {
    const button = make('button', { type: 'button', 'aria-label': words(step > 0 ? 'levels.more' : 'levels.less', { title }) }, step > 0 ? '+' : '−');
    onPress(button, () => {
      slider.value = String(Number(slider.value) + step);
      later();
    });
    return button;
  };
  rulers.set(name, {
    show(level) {
      if (busy || timer !== null) return;
      setProperty(slider, 'value', String(Math.round(level * 100)));
      show();
    },
  });
  return make('div', { className: 'ruler' }, make('label', { 'for': id }, title), stepper(-STEP), slider, stepper(STEP), value);
}

const showEffects = onChange((names) => {
  const buttons = names.map((name) => {
    const state = make('span', { className: 'switch-words' });
    const button = make('button', { type: 'button', role: 'switch', className: 'switch', 'aria-checked': 'false' },
      make('span', { className: 'switch-light', 'aria-hidden': 'true' }), make('b', {}, titled(name)), state);
    button.dataset.effect = name;
    onPress(button, () => {
      const on = button.getAttribute('aria-checked') !== 'true';
      ask(button, `${name} ${words(on ? 'levels.on' : 'levels.off')}`, () => change('PUT', 'levels', { effects: { [name]: on } }));
    });
    return button;
  });
  byId('effects').replaceChildren(...buttons);
});

const showPresets = onChange((names) => {
  const buttons = names.map((name) => {
    const button = make('button', { type: 'button', className: 'preset' }, titled(name));
    onPress(button, () => ask(button, words('levels.preset', { name }), () => change('POST', `presets/${encodeURIComponent(name)}`)));
    return button;
  });
  byId('presets').replaceChildren(...buttons);
});
