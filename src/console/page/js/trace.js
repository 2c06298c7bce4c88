// Where the seat that is looked at was, over the curves of the cue: a point for each status while a show plays.

import { selected } from './controller.js';

/** Points that are kept: twenty minutes. */
const MOST = 12_000;

let of = '';
let offset = 0;
let points = [];

/** Keeps where the seat that is looked at is; forgets all where it is another seat or cue. */
export function keepTrace(status) {
  const seat = status?.controllers.find(({ name }) => name === selected());
  const key = seat && status.show ? `${seat.name} ${status.show.cue} ${status.show.sha256}` : '';
  if (key !== of) {
    of = key;
    points = [];
  }
  const axes = seat?.measured ?? seat?.commanded ?? null;
  if (key === '' || axes === null || status.state !== 'playing') return;
  const at = status.show.position_s;
  if (points.at(-1)?.at === at) return;
  points.push({ at, axes });
  if (points.length > MOST) points.shift();
  offset = seat.axis_offset;
}

/** What the points are of; null where there are none. */
export const tracedSeat = () => (points.length > 0 ? selected() : null);

/** Draws the points between two times onto a plot of uPlot; the colours are those of the axes of the cue. */
export function drawTrace(plot, colours) {
  const { ctx, bbox } = plot;
  const { min, max } = plot.scales.x;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  const size = 3 * window.devicePixelRatio;
  for (const { at, axes } of points) {
    if (at < min || at > max) continue;
    const x = plot.valToPos(at, 'x', true);
    for (const [axis, part] of axes.entries()) {
      ctx.fillStyle = colours[(axis + offset) % colours.length];
      ctx.fillRect(x - size / 2, plot.valToPos(part, 'y', true) - size / 2, size, size);
    }
  }
  ctx.restore();
}
