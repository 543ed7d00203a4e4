// The plots of the last minute: pan, tilt and residual against time, and the histogram of the latency.
// Each plot says in words below it, and to screen readers, what it shows.

import {axes, colour, niceStep, surface} from './canvas.js';
import {element, say} from './elements.js';
import {fixed, isNumber, kDegree} from './numbers.js';
import {kMinute, samples} from './stream.js';

// One value against time. Lines end at gaps, and where an angle goes round.
function plotOverTime(id, key, {scale, name, line, least, fromZero = false, round = Infinity}) {
  const drawn = surface(id);
  if (!drawn) return [];
  const end = samples.length > 0 ? samples[samples.length - 1].t : 0;
  const points = samples.filter((one) => one.t >= end - kMinute);
  const values = points.map((one) => isNumber(one[key]) ? one[key] * scale : null);
  const numbers = values.filter((one) => one !== null);
  let low = numbers.length > 0 ? numbers.reduce((a, b) => Math.min(a, b)) : 0;
  let high = numbers.length > 0 ? numbers.reduce((a, b) => Math.max(a, b)) : 0;
  const missing = Math.max(least, 1.1 * (high - low)) - (high - low);
  low = fromZero ? 0 : low - missing / 2;
  high = fromZero ? Math.max(least, 1.1 * high) : high + missing / 2;
  const at = axes(drawn, {from: -kMinute, to: 0, step: drawn.width < 360 ? 20 : 10, name: 'seconds before the newest record'},
    {from: low, to: high, step: niceStep(high - low, 4), name});
  const {pen} = drawn;
  pen.strokeStyle = colour(line);
  pen.lineWidth = 1.5;
  pen.lineJoin = 'round';
  pen.beginPath();
  for (let i = 0, down = false; i < points.length; ++i) {
    if (values[i] === null) {
      down = false;
      continue;
    }
    const goesOn = down && points[i].t - points[i - 1].t < 1 && Math.abs(values[i] - values[i - 1]) < round;
    pen[goesOn ? 'lineTo' : 'moveTo'](at.x(points[i].t - end), at.y(values[i]));
    down = true;
  }
  pen.stroke();
  return numbers;
}

function describe(id, canvas, what, numbers, unit, digits) {
  const text = numbers.length === 0 ? 'no values' : (() => {
    const low = numbers.reduce((a, b) => Math.min(a, b));
    const high = numbers.reduce((a, b) => Math.max(a, b));
    return `now ${fixed(numbers[numbers.length - 1], digits)}${unit}, from ${fixed(low, digits)} to ${fixed(high, digits)}${unit}`;
  })();
  say(id, `${what}: ${text}`);
  element(canvas).setAttribute('aria-label', `${what} over the last minute: ${text}`);
}

function drawHistogram() {
  const drawn = surface('latency-plot');
  if (!drawn) return;
  const sorted = samples.map((one) => one.latency).filter(isNumber).map((one) => 1000 * one).sort((a, b) => a - b);
  const quantile = (q) => sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))];
  const marks = sorted.length > 0 ? [['p50', quantile(.5)], ['p90', quantile(.9)], ['p99', quantile(.99)]] : [];
  const step = niceStep(marks.length > 0 ? Math.max(.1, 1.15 * marks[2][1]) : 1, 6);
  const end = step * Math.ceil((marks.length > 0 ? Math.max(.1, 1.15 * marks[2][1]) : 1) / step);
  const bins = new Array(40).fill(0);
  let beyond = 0;
  for (const value of sorted) {
    if (value < end) ++bins[Math.floor(Math.max(0, value) / end * bins.length)];
    else ++beyond;
  }
  const most = Math.max(4, ...bins) * 1.08;
  const at = axes(drawn, {from: 0, to: end, step, name: 'ms from the last packet to the record'},
    {from: 0, to: most, step: Math.max(1, niceStep(most, 4)), name: 'frames'});
  const {pen} = drawn;
  pen.fillStyle = colour('pan');
  const width = (at.right - at.left) / bins.length;
  bins.forEach((count, i) => pen.fillRect(at.left + i * width + .5, at.y(count), width - 1, at.bottom - at.y(count)));
  pen.strokeStyle = colour('text');
  pen.fillStyle = colour('text');
  pen.setLineDash([4, 3]);
  pen.textBaseline = 'alphabetic';
  let free = at.left;
  for (const [name, value] of marks) {
    const u = at.x(value);
    pen.beginPath();
    pen.moveTo(u, at.top);
    pen.lineTo(u, at.bottom);
    pen.stroke();
    const start = Math.min(Math.max(free, u - 10), at.right - 22);
    pen.textAlign = 'left';
    pen.fillText(name, start, 16);
    free = start + 26;
  }
  pen.setLineDash([]);
  const text = marks.length === 0 ? 'no latency is measured' :
    `${marks.map(([name, value]) => `${name} ${value.toFixed(2)} ms`).join(', ')}; ${sorted.length} frames, ${beyond} beyond the plot`;
  say('latency-caption', text);
  element('latency-plot').setAttribute('aria-label', `Histogram of the latency over the last minute: ${text}`);
}

export function drawPlots() {
  const pan = plotOverTime('pan-plot', 'pan', {scale: kDegree, name: 'pan, \u00b0', line: 'pan', least: .01, round: 180});
  describe('pan-caption', 'pan-plot', 'Pan', pan, '\u00b0', 4);
  const tilt = plotOverTime('tilt-plot', 'tilt', {scale: kDegree, name: 'tilt, \u00b0', line: 'tilt', least: .01, round: 180});
  describe('tilt-caption', 'tilt-plot', 'Tilt', tilt, '\u00b0', 4);
  const residual = plotOverTime('residual-plot', 'residual', {scale: 1, name: 'rms, px', line: 'pan', least: .02, fromZero: true});
  describe('residual-caption', 'residual-plot', 'Residual', residual, ' px', 3);
  drawHistogram();
}
