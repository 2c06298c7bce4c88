// How a seat stands: a bar for each axis, filled to where it was measured (else to where it was told to go), a line where it was
// told to go. A person who wants less motion on the screen sees it twice a second.

import { make, setProperty, setStyle } from './dom.js';

const CALM_MS = 500;
const calm = window.matchMedia('(prefers-reduced-motion: reduce)');
const shownAt = new WeakMap();

/** Bars for a seat, without axes yet. */
export const makePose = (className) => make('span', { className: `pose ${className}`, 'aria-hidden': 'true' });

/** Shows a controller's pose in such bars. */
export function showPose(bars, { commanded, measured }) {
  const filled = measured ?? commanded;
  setProperty(bars, 'hidden', filled === null);
  if (filled === null) return;
  const now = performance.now();
  if (calm.matches && now - (shownAt.get(bars) ?? -CALM_MS) < CALM_MS) return;
  shownAt.set(bars, now);
  if (bars.children.length !== filled.length) bars.replaceChildren(...filled.map(() => make('i', {}, make('b'))));
  setStyle(bars, '--axes', String(filled.length));
  for (const [axis, part] of filled.entries()) {
    const bar = bars.children[axis];
    setStyle(bar, '--is', percent(part));
    setStyle(bar, '--told', percent(commanded?.[axis] ?? part));
  }
}

const percent = (part) => `${(Math.min(Math.max(part, 0), 1) * 100).toFixed(1)}%`;
