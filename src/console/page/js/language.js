// The language of the page: a table of texts for each in `lang/`, English at hand, another one read where it is wanted. What the hall
// says has stable codes; a table words them, and where it does not the hall's own English stands.

import { make } from './dom.js';
import en from './lang/en.js';

/** Each in its own words. */
const LANGUAGES = { de: 'Deutsch', en: 'English', es: 'Español', fr: 'Français', ja: '日本語', zh: '简体中文' };

const KEY = 'kinocue-language';
/** A table that comes no sooner is not waited for: the hall is shown in English. */
const PATIENCE_MS = 3000;

let table = en;
let language = 'en';
let plurals = new Intl.PluralRules('en');

/** The language that the page speaks, as of Intl. */
export const spoken = () => language;

/** A text, with what is said in it. */
export const words = (key, values = {}) => filled(table[key] ?? en[key] ?? key, values);

const filled = (text, values) => text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);

/** The same of so many, with the figure as it is shown. */
export const counted = (key, count, n) => words(`${key}.${plurals.select(count) === 'one' ? 'one' : 'other'}`, { n });

/** What the hall says by a code, of a kind, with its values in their order; else, in English, as it says it. */
export const said = (kind, { code, of = [] }, english) => (`${kind}.${code}` in table ? words(`${kind}.${code}`, of) : english);

/** Reads the table that was chosen here, or that the browser asks for. */
export async function learn() {
  const wanted = [chosen(), ...navigator.languages].map((tag) => tag?.split('-')[0]).find((tag) => tag in LANGUAGES) ?? 'en';
  const late = new Promise((resolve) => setTimeout(resolve, PATIENCE_MS, null));
  const read = wanted === 'en' ? { default: en } : await Promise.race([import(`./lang/${wanted}.js`).catch(() => null), late]);
  if (read !== null) [table, language, plurals] = [read.default, wanted, new Intl.PluralRules(wanted)];
  document.documentElement.lang = language === 'zh' ? 'zh-Hans' : language;
  for (const attribute of ['aria-label', 'aria-description']) {
    for (const element of document.querySelectorAll(`[data-${attribute}]`)) element.setAttribute(attribute, words(element.getAttribute(`data-${attribute}`)));
  }
  for (const element of document.querySelectorAll('[data-text]')) element.textContent = words(element.dataset.text);
}

/** What was chosen; a browser that keeps nothing has nothing chosen. */
function chosen() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

/** Makes the choice of the language work. The page begins anew in it: what was said already is said in it too. */
export function startLanguage(list) {
  list.append(...Object.entries(LANGUAGES).map(([tag, name]) => make('option', { value: tag, lang: tag, selected: tag === language }, name)));
  list.addEventListener('change', () => {
    localStorage.setItem(KEY, list.value);
    location.reload();
  });
}
