// A canvas as large as it is shown, colours of the style, axes with round steps.
// All sizes are CSS pixels.

import {element} from './elements.js';
import {fixed} from './numbers.js';

// A canvas as large as it is shown, in CSS pixels, cleared.
export function surface(id) {
  const canvas = element(id);
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (width === 0 || height === 0) return null;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext('2d');
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = '11px system-ui, sans-serif';
  return {pen, width, height};
}

export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// Steps of 1, 2 or 5 times a power of ten, about `count` of them.
export function niceStep(span, count) {
  const rough = span / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * ([1, 2, 5].find((one) => one * power >= rough) ?? 10);
}

// Draws the axes and gives back where a point is. x and y: {from, to, step, name}; text, if given,
// writes a value of y.
export function axes({pen, width, height}, x, y) {
  const left = 58;
  const right = width - 8;
  const top = 22;
  const bottom = height - 32;
  const at = {
    x: (value) => left + (value - x.from) / (x.to - x.from) * (right - left),
    y: (value) => bottom - (value - y.from) / (y.to - y.from) * (bottom - top),
    left, right, top, bottom,
  };
  pen.strokeStyle = colour('grid');
  pen.fillStyle = colour('faint');
  pen.lineWidth = 1;
  pen.beginPath();
  pen.textAlign = 'right';
  pen.textBaseline = 'middle';
  const decimals = (step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  for (let i = Math.ceil(y.from / y.step - 1e-9); i * y.step <= y.to + 1e-9 * y.step; ++i) {
    const v = Math.round(at.y(i * y.step)) + .5;
    pen.moveTo(left, v);
    pen.lineTo(right, v);
    pen.fillText(y.text ? y.text(i * y.step) : fixed(i * y.step, decimals(y.step)), left - 6, v);
  }
  pen.textAlign = 'center';
  pen.textBaseline = 'top';
  for (let i = Math.ceil(x.from / x.step - 1e-9); i * x.step <= x.to + 1e-9 * x.step; ++i) {
    const u = Math.round(at.x(i * x.step)) + .5;
    pen.moveTo(u, top);
    pen.lineTo(u, bottom);
    const label = fixed(i * x.step, decimals(x.step));
    pen.fillText(label, Math.min(u, width - pen.measureText(label).width / 2 - 1), bottom + 4);
  }
  pen.stroke();
  pen.textBaseline = 'alphabetic';
  pen.textAlign = 'left';
  pen.fillText(y.name, 4, 10);
  pen.textAlign = 'right';
  pen.fillText(x.name, right, height - 4);
  return at;
}

// Axes as large in both directions, around the ranges xs and ys: [least, largest]. room: how much more than the ranges is
// shown; least: of y over the whole height. names: of x and y. Gives back where a point is, and the size of a pixel, too.
export function equalAxes(drawn, xs, ys, {room, least}, names) {
  const {width, height} = drawn;
  const unit = Math.max(room * (xs[1] - xs[0]) / (width - 66), room * (ys[1] - ys[0]) / (height - 54), least / height);
  const span = (ends, size, name) => {
    const half = unit * size / 2;
    const middle = (ends[0] + ends[1]) / 2;
    return {from: middle - half, to: middle + half, step: niceStep(2 * half, size < 300 ? 3 : 5), name};
  };
  return {...axes(drawn, span(xs, width - 66, names[0]), span(ys, height - 54, names[1])), unit};
}
