// Figures in words: times, parts, durations.

const two = (number) => String(number).padStart(2, '0');

/** A position in the film: 1:02:33.4, or 02:33.4 in the first hour of one that has no other. */
export function clock(seconds, decimals = 1, length = 0) {
  if (seconds === null || seconds === undefined) return '–';
  const factor = 10 ** decimals;
  const whole = Math.round(Math.abs(seconds) * factor);
  const fraction = decimals > 0 ? `.${String(whole % factor).padStart(decimals, '0')}` : '';
  const all = Math.floor(whole / factor);
  const hours = Math.floor(all / 3600);
  const minutes = Math.floor(all / 60) % 60;
  const sign = seconds < 0 && whole > 0 ? '−' : '';
  return `${sign}${hours > 0 || length >= 3600 ? `${hours}:` : ''}${two(minutes)}:${two(all % 60)}${fraction}`;
}

/** How long: 4 s, 3 min, 2 h 5 min. */
export function lasting(seconds) {
  if (seconds < 1) return 'less than 1 s';
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  const minutes = Math.floor(seconds / 60);
  return minutes < 120 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** Microseconds as a person reads them: 40 µs, 1.25 ms, 1.20 s; with as many digits. */
export function micros(us, digits = 3) {
  if (us === null || us === undefined) return '–';
  if (us < 1000) return `${us < 10 ? us.toFixed(1) : Math.round(us)} µs`;
  if (us < 1e6) return `${rounded(us / 1000, digits)} ms`;
  return `${rounded(us / 1e6, digits)} s`;
}

const rounded = (number, digits) => (number >= 10 ** digits ? String(Math.round(number)) : number.toPrecision(digits));

/** A part of 1: 60 %. */
export const percent = (part) => `${Math.round(part * 100)} %`;

/** A figure with the sign of a minus, not a hyphen. */
export const minus = (figure) => String(figure).replace('-', '−');

/** A trim: +10 ms, −40 ms. */
export const signed = (ms) => `${ms > 0 ? '+' : ms < 0 ? '−' : ''}${Math.abs(ms)} ms`;

/** How far a film is ahead of another: 3.2 s later, 40 ms earlier. */
export function span(seconds) {
  const least = Math.abs(seconds);
  const figure = least < 1 ? `${Math.round(least * 1000)} ms` : `${least.toFixed(1)} s`;
  return `${figure} ${seconds < 0 ? 'earlier' : 'later'}`;
}

/** Acks over frames: never rounded up to 100 %, because one lost frame is one lost frame. */
export function ackRate(rate) {
  if (rate === null || rate === undefined) return '–';
  const all = Math.floor(rate * 1000) / 10;
  return all >= 100 ? '100 %' : `${all.toFixed(1)} %`;
}

/** A whole number with thin gaps: 1 234 567. */
export const whole = (number) => String(number).replace(/\B(?=(\d{3})+$)/g, '\u202f');

/** A time of day of an RFC 3339 time, in the zone it was written in. */
export const timeOfDay = (rfc3339) => /T(\d\d:\d\d:\d\d)/.exec(rfc3339)?.[1] ?? rfc3339;

/** What the bits of a word stand for: X01, X04; `none` where no bit is set. */
export function bits(word, letter) {
  if (word === null || word === undefined) return 'unknown';
  const set = Array.from({ length: 16 }, (_, bit) => bit).filter((bit) => word & (1 << bit));
  return set.length > 0 ? set.map((bit) => `${letter}${two(bit + 1)}`).join(' ') : 'none';
}

/** A name of the configuration as a title: kids_gentle becomes Kids gentle. */
export const titled = (name) => sentence(name.replaceAll('_', ' '));

/** The first letter large. */
export const sentence = (text) => (text ? text[0].toUpperCase() + text.slice(1) : '');
