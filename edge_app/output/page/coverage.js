// What the motion at hand has shown: the parts of the picture in which points were seen, and where the head was.
// The dashed square is the range of pan and tilt that is asked for.

import {element, say} from './elements.js';
import {svg} from './motion_figure.js';
import {degrees} from './numbers.js';

const kSize = 100;  // of the drawing of the angles, in its own units

function showCells({columns, rows: lines, points}) {
  const seen = points.filter((count) => count > 0).length;
  element('cells').setAttribute('viewBox', `0 0 ${10 * columns} ${10 * lines}`);
  element('cells').replaceChildren(...points.map((count, i) => svg('rect', {
    x: 10 * (i % columns) + .5, y: 10 * Math.floor(i / columns) + .5, width: 9, height: 9,
    class: `cell seen${count === 0 ? 0 : count < 10 ? 1 : 2}`})));
  const text = `Points were seen in ${seen} of ${points.length} parts of the picture`;
  element('cells').setAttribute('aria-label', text);
  say('cells-caption', `${text}.`);
}

function showAngles({pan_rad: pan, tilt_rad: tilt, path_rad: path}, asked) {
  element('angles-figure').hidden = !pan;
  if (!pan) return;
  const middle = [(pan[0] + pan[1]) / 2, (tilt[0] + tilt[1]) / 2];
  const scale = kSize / 1.15 / Math.max(asked, pan[1] - pan[0], tilt[1] - tilt[0]);
  const at = ([p, t]) => `${(kSize / 2 + scale * (p - middle[0])).toFixed(1)},${(kSize / 2 - scale * (t - middle[1])).toFixed(1)}`;
  const side = scale * asked;
  element('angles').replaceChildren(
    svg('rect', {x: (kSize - side) / 2, y: (kSize - side) / 2, width: side, height: side, class: 'asked'}),
    svg('polyline', {points: path.map(at).join(' '), class: 'path'}));
  const text = `Pan ${degrees(pan[1] - pan[0], 2)} and tilt ${degrees(tilt[1] - tilt[0], 2)} of the ${degrees(asked, 2)} that are asked for`;
  element('angles').setAttribute('aria-label', text);
  say('angles-caption', `${text}.`);
}

export function showCoverage(coverage, asked) {
  showCells(coverage);
  showAngles(coverage, asked);
}
