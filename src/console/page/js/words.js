// Figures in words: times, parts, durations, with the marks of the language.

import { spoken, words } from './language.js';

const two = (number) => String(number).padStart(2, '0');
const formats = new Map();

/** A number with so many places; with the sign of a minus, not a hyphen. */
export function number(figure, digits = 0, style = 'decimal') {
  const key = `${style} ${digits}`;
  if (!formats.has(key)) {
    formats.set(key, new Intl.NumberFormat(spoken(), { style, minimumFractionDigits: digits, maximumFractionDigits: digits }));
  }
  return formats.get(key).format(figure).replace('-', '−');
}

/** A position in the film: 1:02:33.4, or 02:33.4 in the first hour of one that has no other. */
export function clock(seconds, decimals = 1, length = 0) {
  if (seconds === null || seconds === undefined) return '–';
  const factor = 10 ** decimals;
  const whole = Math.round(Math.abs(seconds) * factor);
  const fraction = decimals > 0 ? number((whole % factor) / factor, decimals).slice(1) : '';
  const all = Math.floor(whole / factor);
  const hours = Math.floor(all / 3600);
  const minutes = Math.floor(all / 60) % 60;
  const sign = seconds < 0 && whole > 0 ? '−' : '';
  return `${sign}${hours > 0 || length >= 3600 ? `${hours}:` : ''}${two(minutes)}:${two(all % 60)}${fraction}`;
}

/** How long: 4 s, 3 min, 2 h 5 min. */
export function lasting(seconds) {
  if (seconds < 1) return words('for.moment');
  if (seconds < 120) return words('for.seconds', { s: Math.floor(seconds) });
  const minutes = Math.floor(seconds / 60);
  return minutes < 120 ? words('for.minutes', { min: minutes }) : words('for.hours', { h: Math.floor(minutes / 60), min: minutes % 60 });
}

/** Microseconds as a person reads them: 40 µs, 1.25 ms, 1.20 s; with as many digits. */
export function micros(us, digits = 3) {
  if (us === null || us === undefined) return '–';
  if (us < 1000) return `${number(us, us < 10 ? 1 : 0)} µs`;
  if (us < 1e6) return `${rounded(us / 1000, digits)} ms`;
  return `${rounded(us / 1e6, digits)} s`;
}

/** With so many digits before and after the point. */
const rounded = (figure, digits) => number(figure, Math.max(digits - String(Math.floor(figure)).length, 0));

/** A part of 1: 60%, 60 %. */
export const percent = (part, digits = 0) => number(part, digits, 'percent');

/** A trim: +10 ms, −40 ms. */
export const signed = (ms) => `${plus(ms)}${number(ms, Number.isInteger(ms) ? 0 : 1)} ms`;

/** The sign of what is more than nothing. */
export const plus = (figure) => (figure > 0 ? '+' : '');

/** How far a film is ahead of another: 3.2 s later, 40 ms earlier. */
export function span(seconds) {
  const least = Math.abs(seconds);
  const figure = least < 1 ? `${Math.round(least * 1000)} ms` : `${number(least, 1)} s`;
  return words(seconds < 0 ? 'span.earlier' : 'span.later', { figure });
}

/** Acks over frames: never rounded up to 100 %, because one lost frame is one lost frame. */
export function ackRate(rate) {
  if (rate === null || rate === undefined) return '–';
  return rate >= 1 ? percent(1) : percent(Math.floor(rate * 1000) / 1000, 1);
}

/** A whole number in groups of three. */
export const whole = (figure) => number(figure);

/** What the bits of a word stand for: X01, X04; `none` where no bit is set. */
export function bits(word, letter) {
  if (word === null || word === undefined) return words('figure.unknown');
  const set = Array.from({ length: 16 }, (_, bit) => bit).filter((bit) => word & (1 << bit));
  return set.length > 0 ? set.map((bit) => `${letter}${two(bit + 1)}`).join(' ') : words('figure.none');
}

/** A name of the configuration as a title: kids_gentle becomes Kids gentle. */
export const titled = (name) => sentence(name.replaceAll('_', ' '));

/** The first letter large. */
export const sentence = (text) => (text ? text[0].toUpperCase() + text.slice(1) : '');
