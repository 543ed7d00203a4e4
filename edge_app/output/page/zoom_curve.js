// The zoom curve of the calibration: focal length over the zoom reading, as plot and as table.
// Hidden while the calibration has none.

import {axes, colour, niceStep, surface} from './canvas.js';
import {element, rows, say} from './elements.js';
import {withSigma} from './numbers.js';

let zoomCurve = null;

export function showZoomCurve(curve) {
  zoomCurve = curve;
  element('zoom').hidden = !zoomCurve;
  if (!zoomCurve) return;
  rows('zoom-nodes', zoomCurve.nodes.map((node) => [`Zoom ${node.reading}`,
    `${withSigma(node.focal_length.value, node.focal_length.sigma, 1, 'px')}${node.centre_offset
      ? `; centre ${withSigma(node.centre_offset.value, node.centre_offset.sigma, 1, 'px')}` : ''}`]));
  drawZoomCurve();
}

// The logarithm of the focal length over the reading: a band of two standard deviations, the nodes, and where the lens is.
export function drawZoomCurve() {
  if (!zoomCurve) return;
  const drawn = surface('zoom-plot');
  if (!drawn) return;
  const {reading, focal_length_px: f, focal_length_sigma_px: sigma} = zoomCurve.samples;
  const low = f.map((value, i) => Math.log10(value) + Math.log10(Math.max(1e-3, 1 - 2 * sigma[i] / value)));
  const high = f.map((value, i) => Math.log10(value + 2 * sigma[i]));
  const nodes = zoomCurve.nodes.map((node) => [node.reading, Math.log10(node.focal_length.value)]);
  const [from, to] = [reading[0], reading[reading.length - 1]];
  const margin = .04 * (to - from);
  const bottom = Math.min(...low, ...nodes.map((node) => node[1]));
  const top = Math.max(...high, ...nodes.map((node) => node[1]));
  const at = axes(drawn, {from: from - margin, to: to + margin, step: niceStep(to - from, drawn.width < 360 ? 3 : 6), name: 'zoom reading'},
    {from: bottom - .03, to: top + .03, step: niceStep(top - bottom + .06, 4), name: 'log\u2081\u2080 of the focal length, px'});
  const {pen} = drawn;
  pen.fillStyle = colour('grid');
  pen.beginPath();
  reading.forEach((value, i) => pen[i ? 'lineTo' : 'moveTo'](at.x(value), at.y(high[i])));
  for (let i = reading.length - 1; i >= 0; --i) pen.lineTo(at.x(reading[i]), at.y(low[i]));
  pen.fill();
  pen.strokeStyle = colour('pan');
  pen.lineWidth = 1.5;
  pen.beginPath();
  reading.forEach((value, i) => pen[i ? 'lineTo' : 'moveTo'](at.x(value), at.y(Math.log10(f[i]))));
  pen.stroke();
  pen.fillStyle = colour('pan');
  for (const [x, y] of nodes) {
    pen.beginPath();
    pen.arc(at.x(x), at.y(y), 3, 0, 2 * Math.PI);
    pen.fill();
  }
  const text = `${nodes.length} calibrated visits, focal length ${Math.round(f[0])} px at ${from} to ${Math.round(f[f.length - 1])} px at ${to}; the band is two standard deviations`;
  say('zoom-caption', text);
  element('zoom-plot').setAttribute('aria-label', `Focal length over zoom reading: ${text}`);
}
