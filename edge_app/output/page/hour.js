// The plots of the last hour, from /api/v1/history: sigma, clock offset, telemetry's error.
// Lines end where rows are missing or have no value; words below each plot say what it shows.

import {getJson} from './api.js';
import {axes, colour, niceStep, surface} from './canvas.js';
import {element, say} from './elements.js';
import {fixed, isNumber, small} from './numbers.js';
import {connected, onNewProcess} from './stream.js';
import {sleep} from './time.js';

const kHourInterval = 10000;  // ms, as a row is 10 s
const kRow = 10;              // s
const kSpans = [5, 10, 20, 30, 60];  // min, that the plots show

let rowsOfHour = [];  // {minutes (before the newest, < 0), sigma, offset, offsetSigma, pan, tilt}

function showHour(columns) {
  const newest = columns.time_s[columns.time_s.length - 1];
  rowsOfHour = columns.time_s.map((time, i) => ({
    minutes: (time - newest) / 60, sigma: columns.sigma_rad[i], offset: columns.clock_offset_s[i],
    offsetSigma: columns.clock_offset_sigma_s[i], pan: columns.pan_error_rad[i], tilt: columns.tilt_error_rad[i],
  }));
  drawHour();
}

const valuesOf = (key) => rowsOfHour.map((row) => row[key]).filter(isNumber);
const largest = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);
const smallest = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);

// Runs of neighbouring rows that have this value.
function runsOf(key) {
  const runs = [];
  let before = null;
  for (const row of rowsOfHour) {
    if (!isNumber(row[key])) {
      before = null;
      continue;
    }
    if (before !== null && (row.minutes - before) * 60 < 2.5 * kRow) runs[runs.length - 1].push(row);
    else runs.push([row]);
    before = row.minutes;
  }
  return runs;
}

function drawLine(pen, at, key, value, line) {
  pen.strokeStyle = colour(line);
  pen.lineWidth = 1.75;
  pen.lineJoin = 'round';
  pen.lineCap = 'round';
  pen.beginPath();
  for (const run of runsOf(key)) {
    run.forEach((row, i) => pen[i ? 'lineTo' : 'moveTo'](at.x(row.minutes), at.y(value(row))));
    // A row alone is a dot.
    if (run.length === 1) pen.lineTo(at.x(run[0].minutes) + 2, at.y(value(run[0])));
  }
  pen.stroke();
}

// Canvas and axes, with time from the oldest row on; null: the canvas is not shown.
function begin(id, y) {
  const drawn = surface(id);
  if (!drawn) return null;
  const oldest = rowsOfHour.length > 0 ? -rowsOfHour[0].minutes : 0;
  const span = kSpans.find((one) => one >= oldest) ?? kSpans[kSpans.length - 1];
  const x = {from: -span, to: 0, step: niceStep(span, drawn.width < 360 ? 3 : 6), name: 'minutes before the newest record'};
  return {pen: drawn.pen, at: axes(drawn, x, y)};
}

function describeHour(name, what, text) {
  const missing = rowsOfHour.length > 0 ? '' : '; no record yet';
  say(`${name}-caption`, `${what}: ${text}${missing}`);
  element(`${name}-plot`).setAttribute('aria-label', `${what} over the last hour: ${text}${missing}`);
}

function drawSigma() {
  const microradians = valuesOf('sigma').filter((value) => value > 0).map((value) => 1e6 * value);
  const from = microradians.length > 0 ? Math.floor(Math.log10(smallest(microradians))) : 0;
  const to = microradians.length > 0 ? Math.max(from + 1, Math.ceil(Math.log10(largest(microradians)))) : 3;
  const drawn = begin('sigma-plot', {from, to, step: 1, name: 'sigma, \u00b5rad (logarithmic)', text: (power) => fixed(10 ** power, Math.max(0, -power))});
  if (drawn) drawLine(drawn.pen, drawn.at, 'sigma', (row) => Math.log10(Math.max(1e6 * row.sigma, 10 ** from)), 'pan');
  describeHour('sigma', 'Sigma', microradians.length === 0 ? 'no values'
    : `now ${small(rowsOfHour[rowsOfHour.length - 1].sigma)}, from ${small(1e-6 * smallest(microradians))} to ${small(1e-6 * largest(microradians))}`);
}

function drawOffset() {
  const known = rowsOfHour.filter((row) => isNumber(row.offset));
  const low = known.length > 0 ? smallest(known.map((row) => 1e3 * (row.offset - 2 * row.offsetSigma))) : 0;
  const high = known.length > 0 ? largest(known.map((row) => 1e3 * (row.offset + 2 * row.offsetSigma))) : 0;
  const span = Math.max(.1, 1.2 * (high - low));
  const middle = (low + high) / 2;
  const drawn = begin('offset-plot', {from: middle - span / 2, to: middle + span / 2, step: niceStep(span, 4), name: 'clock offset, ms'});
  if (drawn) {
    const {pen, at} = drawn;
    pen.fillStyle = colour('pan');
    pen.globalAlpha = .2;
    for (const run of runsOf('offset')) {
      const edge = (row, side) => at.y(1e3 * (row.offset + side * 2 * row.offsetSigma));
      pen.beginPath();
      run.forEach((row, i) => pen[i ? 'lineTo' : 'moveTo'](at.x(row.minutes), edge(row, 1)));
      [...run].reverse().forEach((row) => pen.lineTo(at.x(row.minutes), edge(row, -1)));
      pen.fill();
    }
    pen.globalAlpha = 1;
    drawLine(pen, at, 'offset', (row) => 1e3 * row.offset, 'pan');
  }
  const last = known[known.length - 1];
  describeHour('offset', 'Clock offset', last === undefined ? 'no calibration'
    : `now ${fixed(1e3 * last.offset, 3)} \u00b1 ${fixed(1e3 * last.offsetSigma, 3)} ms; the band is two standard deviations`);
}

function drawError() {
  const most = Math.max(.01, 1.1e3 * largest([...valuesOf('pan'), ...valuesOf('tilt'), 0]));
  const drawn = begin('error-plot', {from: 0, to: most, step: niceStep(most, 4), name: 'telemetry\u2019s error, mrad rms'});
  if (drawn) {
    const {pen, at} = drawn;
    ['pan', 'tilt'].forEach((key, i) => {
      drawLine(pen, at, key, (row) => 1e3 * row[key], key);
      pen.fillStyle = colour(key);
      pen.textAlign = 'right';
      pen.fillText(key, at.right - 32 * (1 - i), 10);
    });
  }
  const told = ['pan', 'tilt'].filter((key) => valuesOf(key).length > 0)
    .map((key) => `${key} ${fixed(1e3 * valuesOf(key).at(-1), 3)} mrad, at most ${fixed(1e3 * largest(valuesOf(key)), 3)}`);
  describeHour('error', 'Telemetry\u2019s error', told.length === 0 ? 'no record in mode OE' : told.join('; '));
}

export function drawHour() {
  drawSigma();
  drawOffset();
  drawError();
}

export async function showHourForEver() {
  for (;;) {
    if (connected && !document.hidden) await getJson('/api/v1/history?span=hour').then(showHour).catch(() => null);
    await sleep(connected ? kHourInterval : 250);
  }
}

onNewProcess(() => {
  rowsOfHour = [];
  drawHour();
});
