// What the calibration knows of telemetry's own error: over the angle, and the loop of play.
// Each plot is hidden while there is nothing to show.

import {axes, colour, niceStep, surface} from './canvas.js';
import {element, say} from './elements.js';
import {fixed, isNumber, kDegree} from './numbers.js';

const kAxes = ['pan', 'tilt'];

let angleErrors = [];  // [axis, samples, unseen]
let plays = [];        // [axis, play]

const milliradians = (radians) => fixed(1e3 * radians, 3);

export function showTelemetryError(calibration) {
  angleErrors = kAxes.filter((axis) => calibration[`${axis}_error`]?.samples?.angle_rad.length > 1)
    .map((axis) => [axis, calibration[`${axis}_error`].samples, calibration[`${axis}_error`].unseen_sigma_rad]);
  plays = kAxes.filter((axis) => isNumber(calibration[`${axis}_play_rad`]?.value)).map((axis) => [axis, calibration[`${axis}_play_rad`]]);
  element('angle-error').hidden = angleErrors.length === 0;
  element('play').hidden = plays.length === 0;
  drawTelemetryError();
}

// A band of two standard deviations and a line, for each axis.
function drawAngleErrors() {
  if (angleErrors.length === 0) return;
  const drawn = surface('angle-error-plot');
  if (!drawn) return;
  const angles = angleErrors.flatMap(([, {angle_rad: angle}]) => [angle[0], angle[angle.length - 1]]).map((angle) => angle * kDegree);
  const from = Math.min(...angles);
  const to = Math.max(...angles);
  const most = 1.1e3 * Math.max(...angleErrors.flatMap(([, {error_rad: error, sigma_rad: sigma}]) => error.map((value, i) => Math.abs(value) + 2 * sigma[i])));
  const at = axes(drawn, {from, to, step: niceStep(to - from, drawn.width < 360 ? 3 : 6), name: 'true angle, \u00b0'},
    {from: -most, to: most, step: niceStep(2 * most, 4), name: 'telemetry\u2019s error, mrad'});
  const {pen} = drawn;
  for (const [axis, {angle_rad: angle, error_rad: error, sigma_rad: sigma}] of angleErrors) {
    const u = (i) => at.x(angle[i] * kDegree);
    pen.fillStyle = colour(axis);
    pen.globalAlpha = .2;
    pen.beginPath();
    angle.forEach((_, i) => pen[i ? 'lineTo' : 'moveTo'](u(i), at.y(1e3 * (error[i] + 2 * sigma[i]))));
    for (let i = angle.length - 1; i >= 0; --i) pen.lineTo(u(i), at.y(1e3 * (error[i] - 2 * sigma[i])));
    pen.fill();
    pen.globalAlpha = 1;
    pen.strokeStyle = colour(axis);
    pen.lineWidth = 1.5;
    pen.beginPath();
    angle.forEach((_, i) => pen[i ? 'lineTo' : 'moveTo'](u(i), at.y(1e3 * error[i])));
    pen.stroke();
  }
  const rms = (values) => Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / values.length);
  const text = angleErrors.map(([axis, {error_rad: error, sigma_rad: sigma}, unseen]) => {
    return `${axis} ${milliradians(rms(error))} mrad, known to ${milliradians(rms(sigma))}, elsewhere to ${milliradians(unseen)}`;
  }).join('; ');
  say('angle-error-caption', `Telemetry\u2019s error over the angle: ${text}; bands are two standard deviations`);
  element('angle-error-plot').setAttribute('aria-label', `Telemetry's error over the angle: ${text}`);
}

// Reading less camera on a way to and fro: it changes by the play's width behind each turn.
function drawPlays() {
  if (plays.length === 0) return;
  const drawn = surface('play-plot');
  if (!drawn) return;
  const widest = 1e3 * Math.max(...plays.map(([, {value}]) => value));
  const most = 1e3 * .65 * Math.max(...plays.map(([, {value, sigma}]) => value + 2 * sigma));
  const at = axes(drawn, {from: -2 * widest, to: 2 * widest, step: niceStep(4 * widest, drawn.width < 360 ? 3 : 6), name: 'way to and fro, mrad'},
    {from: -most, to: most, step: niceStep(2 * most, 4), name: 'reading \u2212 camera, mrad'});
  const {pen} = drawn;
  for (const [axis, {value, sigma, kind}] of plays) {
    const width = 1e3 * value;
    const sign = kind === 'motor' ? 1 : -1;
    pen.fillStyle = colour(axis);
    pen.globalAlpha = .2;
    for (const side of [-1, 1]) {
      const top = at.y(side * width / 2 + 1e3 * sigma);
      pen.fillRect(at.left, top, at.right - at.left, at.y(side * width / 2 - 1e3 * sigma) - top);
    }
    pen.globalAlpha = 1;
    pen.strokeStyle = colour(axis);
    pen.lineWidth = 1.5;
    pen.beginPath();
    const end = 2 * widest;
    const corners = [[end, sign], [end - width, -sign], [-end, -sign], [-end + width, sign], [end, sign]];
    corners.forEach(([x, side], i) => pen[i ? 'lineTo' : 'moveTo'](at.x(x), at.y(side * width / 2)));
    pen.stroke();
  }
  const text = plays.map(([axis, {value, sigma, kind}]) => {
    return `${axis} ${milliradians(value)} \u00b1 ${milliradians(sigma)} mrad, encoder ${kind === 'motor' ? 'on the motor' : 'behind the gear'}`;
  }).join('; ');
  say('play-caption', `Play: ${text}; bands are two standard deviations`);
  element('play-plot').setAttribute('aria-label', `Loop of play: ${text}`);
}

export function drawTelemetryError() {
  drawAngleErrors();
  drawPlays();
}
