// The plan of the targets from above (on the sphere: azimuth and elevation), and their table.
// Dashed: what the picture shows.

import {postJson} from './api.js';
import {colour, equalAxes, surface} from './canvas.js';
import {rows, say} from './elements.js';
import {isNumber, kDegree, withSigma} from './numbers.js';
import {chooseFree, ellipse, labelsOf, seenLastFirst, targetColour, targetName} from './target_names.js';
import {targets, trails} from './targets.js';
import {duration} from './time.js';

const kListed = 20;  // targets in the table

let view = [];       // around what the picture shows, as the plan has it

// What the picture shows: down its left side and up its right one, as far as that has places.
async function viewOf(frame, {width, height}) {
  const downwards = [0, .05, .1, .2, .3, .4, .5, .6, .8, 1].map((share) => share * height);
  const pixels = [...downwards.map((v) => [0, v]), ...downwards.reverse().map((v) => [width, v])];
  const {directions} = await postJson('/api/v1/direction', {frame, pixels});
  return directions.map((one) => targets.space === 'plane' ? one.plane?.position_m
    : isNumber(one.azimuth_rad) ? [one.azimuth_rad * kDegree, one.elevation_rad * kDegree] : null).filter((one) => one);
}

export async function showView(frame, overlay) {
  view = await viewOf(frame, overlay).catch(() => view);
}

// Beside each target, to the right or the left.
function drawNames(pen, at, near) {
  const kHeight = 13;
  pen.fillStyle = colour('text');
  pen.textAlign = 'left';
  pen.textBaseline = 'middle';
  const places = seenLastFirst(targets.targets.filter((one) => trails.has(one.identity))).map((target) => {
    const [x, y] = near(trails.get(target.identity).at(-1));
    return labelsOf(target).flatMap((text) => {
      const width = pen.measureText(text).width;
      return [0, -kHeight, kHeight].flatMap((down) => [8, -8 - width].map((right) => {
        const left = at.x(x) + right;
        const middle = at.y(y) + down;
        return {text, left, right: left + width, top: middle - kHeight / 2, bottom: middle + kHeight / 2};
      }));
    });
  });
  for (const {text, left, top, bottom} of chooseFree(places, at)) pen.fillText(text, left, (top + bottom) / 2);
}

export function drawPlan() {
  if (!targets) return;
  const drawn = surface('plan');
  if (!drawn) return;
  const onPlane = targets.space === 'plane';
  // Nothing goes round: azimuths are within half a turn of the first.
  const first = (view[0] ?? [...trails.values()][0]?.[0] ?? [0])[0];
  const near = ([x, y]) => onPlane ? [x, y] : [x - 360 * Math.round((x - first) / 360), y];
  const seen = view.map(near);
  const walked = [...trails.values()].flat().map(near);
  const shown = walked.length > 0 ? walked : seen;
  const range = (i) => shown.length > 0 ? [Math.min(...shown.map((one) => one[i])), Math.max(...shown.map((one) => one[i]))] : [0, 0];
  const [xs, ys] = [range(0), range(1)];
  const at = equalAxes(drawn, xs, ys, {room: 1.4, least: onPlane ? 20 : 1},
    onPlane ? ['x, m', 'y, m'] : ['azimuth, \u00b0', 'elevation, \u00b0']);
  const {pen} = drawn;
  pen.save();
  pen.beginPath();
  pen.rect(at.left, at.top, at.right - at.left, at.bottom - at.top);
  pen.clip();
  pen.strokeStyle = colour('faint');
  pen.setLineDash([4, 3]);
  pen.beginPath();
  seen.forEach(([x, y], i) => pen[i ? 'lineTo' : 'moveTo'](at.x(x), at.y(y)));
  pen.closePath();
  pen.stroke();
  pen.setLineDash([]);
  for (const target of targets.targets) {
    const trail = (trails.get(target.identity) ?? []).map(near);
    if (trail.length === 0) continue;
    pen.strokeStyle = targetColour(target.identity);
    pen.lineWidth = 1.5;
    pen.beginPath();
    trail.forEach(([x, y], i) => pen[i ? 'lineTo' : 'moveTo'](at.x(x), at.y(y)));
    pen.stroke();
    if (!target.covariance) continue;  // at a pole
    const [x, y] = trail[trail.length - 1];
    const factor = (onPlane ? 1 : kDegree) / at.unit;
    // Upwards is down on a canvas.
    const [long, short, turn] = ellipse(target.covariance.map((row) => row.slice(0, 2)));
    pen.beginPath();
    pen.ellipse(at.x(x), at.y(y), Math.max(2, long * factor), Math.max(2, short * factor), -turn, 0, 2 * Math.PI);
    pen.stroke();
  }
  pen.restore();
  drawNames(pen, at, near);
  const count = targets.targets.length;
  say('plan-caption', `${count} ${count === 1 ? 'target' : 'targets'} after frame ${targets.detected_frame}; ellipses hold 95 %; dashed: what the picture shows${count > kListed ? `; the first ${kListed} are listed` : ''}`);
  rows('target-rows', targets.targets.slice(0, kListed).map((target) => {
    const spread = (i) => Math.sqrt(Math.max(0, target.covariance[i][i]));
    const where = onPlane ? withSigma(target.position_m, [spread(0), spread(1)], 1, 'm')
      : target.covariance ? withSigma([target.azimuth_rad, target.elevation_rad], [spread(0), spread(1)], kDegree, '\u00b0') : '\u2013';
    const unseen = targets.time_s - target.seen_s;
    return [targetName(target), `${where}${unseen > .5 ? `; unseen for ${duration(unseen)}` : ''}`];
  }));
}
