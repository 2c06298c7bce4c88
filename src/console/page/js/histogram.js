// Histograms of lateness and ack latency. The counts are drawn by their logarithm: the few late ones are what matters.

import { byId, draw, make, onChange, setAttribute, setText } from './dom.js';
import { micros, whole } from './words.js';
import { words } from './language.js';

const WIDTH = 480;
const HEIGHT = 150;
const FOOT = 24;

const drawLateness = onChange((histogram) => drawInto(byId('lateness'), histogram));
const drawLatency = onChange((histogram) => drawInto(byId('latency'), histogram));

/** Shows both, with their figures. */
export function showHistograms(status) {
  if (!status) return;
  showFigures(byId('lateness-figures'), status.lateness);
  showFigures(byId('latency-figures'), status.ack_latency);
  drawLateness(status.lateness.histogram);
  drawLatency(status.ack_latency.histogram);
  const missed = whole(status.missed_ticks);
  const { policy, priority } = status.realtime;
  setText(byId('ticks'), words('lateness.ticks', { ticks: whole(status.ticks), rate: status.rate_hz, missed, policy: `${policy} ${priority}` }));
  setText(byId('frames'), framesOf(status.controllers));
}

function framesOf(controllers) {
  const sum = (figure) => whole(controllers.reduce((all, each) => all + each[figure], 0));
  return words('latency.frames', { sent: sum('sent'), asked: sum('asked'), acked: sum('acked'), refused: sum('refused'), lost: sum('lost') });
}

function showFigures(place, { p50_us: p50, p99_us: p99, p999_us: p999, max_us: max }) {
  const figures = [['p50', p50], ['p99', p99], ['p99.9', p999], [words('histogram.max'), max]];
  if (place.children.length === 0) {
    place.append(...figures.map(([title]) => make('span', { className: 'figure-pair' }, make('span', { className: 'quiet' }, title), make('b'))));
  }
  for (const [index, [, us]] of figures.entries()) setText(place.children[index].lastChild, micros(us));
}

function drawInto(place, { bounds_us: bounds, counts }) {
  const first = counts.findIndex((count) => count > 0);
  if (first < 0) {
    place.replaceChildren(make('p', { className: 'quiet' }, words('histogram.none')));
    setAttribute(place, 'aria-label', words('histogram.none'));
    return;
  }
  const from = Math.max(first - 1, 0);
  const to = Math.min(counts.findLastIndex((count) => count > 0) + 1, counts.length - 1);
  const buckets = counts.slice(from, to + 1).map((count, index) => ({ count, upTo: bounds[from + index] }));
  const most = Math.max(...counts);
  const step = WIDTH / buckets.length;
  const every = Math.ceil(buckets.length / 7);
  const parts = buckets.flatMap(({ count, upTo }, index) => bar(count, upTo, index, { step, most, labelled: index % every === 0 }));
  const picture = draw('svg', { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: 'bars' }, ...parts);
  place.replaceChildren(picture, make('p', { className: 'quiet scale' }, words('histogram.scale')));
  setAttribute(place, 'aria-label', spoken(buckets));
}

function bar(count, upTo, index, { step, most, labelled }) {
  const room = HEIGHT - FOOT - 14;
  const height = count === 0 ? 0 : (room * Math.log1p(count)) / Math.log1p(most);
  const x = index * step;
  const parts = [draw('rect', {
    x: x + step * 0.08, y: HEIGHT - FOOT - height, width: step * 0.84, height, class: upTo === undefined ? 'bar over' : 'bar',
  })];
  if (labelled || upTo === undefined) {
    const label = draw('text', { x: x + step / 2, y: HEIGHT - 7, class: 'bar-label' });
    label.textContent = upTo === undefined ? words('histogram.more') : micros(upTo);
    parts.push(label);
  }
  return parts;
}

function spoken(buckets) {
  const parts = buckets.filter(({ count }) => count > 0).map(({ count, upTo }) => words('histogram.bucket', { n: whole(count), time: upTo === undefined ? words('histogram.more') : micros(upTo) }));
  return parts.join(', ');
}
