// The scene map from its base: what each keyframe shows, and what the present picture shows.
// Hidden while no scene map is in use.

import {getJson, postJson} from './api.js';
import {colour, equalAxes, surface} from './canvas.js';
import {element, say} from './elements.js';
import {isNumber, kDegree} from './numbers.js';
import {onNewProcess, record} from './stream.js';

let keyframes = null;  // borders as [azimuth, elevation] in degrees; null: not asked yet
let present = [];      // the border of the present picture
let isTied = false;    // the present picture is in the map's base

const inDegrees = ([azimuth, elevation]) => [azimuth * kDegree, elevation * kDegree];

// status: of /api/v1/status.
export async function showSceneMap(status) {
  const shown = status.scene_map !== null;
  element('scene').hidden = !shown;
  if (!shown) return;
  keyframes ??= (await getJson('/api/v1/map/views')).keyframes.map((one) => one.border_rad.map(inDegrees));
  drawSceneMap();
}

// What this frame shows, along its border.
export async function showPlaceInScene(frame, {width, height}) {
  if (!keyframes) return;
  const shares = [0, .25, .5, .75];
  const pixels = [...shares.map((s) => [s * width, 0]), ...shares.map((s) => [width, s * height]),
    ...shares.map((s) => [(1 - s) * width, height]), ...shares.map((s) => [0, (1 - s) * height])];
  const answer = await postJson('/api/v1/direction', {frame, pixels}).catch(() => null);
  if (!answer) return;
  present = answer.directions.filter((one) => isNumber(one.azimuth_rad)).map((one) => inDegrees([one.azimuth_rad, one.elevation_rad]));
  isTied = record !== null && record.localized !== null;
}

// Azimuths within half a turn of the first corner: nothing goes round.
function unrolled(border, first) {
  const turns = 360 * Math.round((border[0][0] - first) / 360);
  return border.map(([x, y]) => [x - turns - 360 * Math.round((x - border[0][0]) / 360), y]);
}

export function drawSceneMap() {
  if (!keyframes || element('scene').hidden) return;
  const drawn = surface('scene-plot');
  if (!drawn) return;
  const borders = keyframes.filter((one) => one.length > 2);
  const first = (borders[0] ?? present)[0]?.[0] ?? 0;
  const places = borders.map((one) => unrolled(one, first));
  const here = present.length > 2 ? unrolled(present, first) : [];
  const all = [...places, here].flat();
  const range = (i) => all.length > 0 ? [Math.min(...all.map((one) => one[i])), Math.max(...all.map((one) => one[i]))] : [-1, 1];
  const at = equalAxes(drawn, range(0), range(1), {room: 1.1, least: 0}, ['azimuth, \u00b0', 'elevation, \u00b0']);
  const {pen} = drawn;
  const outline = (border) => {
    pen.beginPath();
    border.forEach(([x, y], i) => pen[i ? 'lineTo' : 'moveTo'](at.x(x), at.y(y)));
    pen.closePath();
  };
  pen.fillStyle = colour('grid');
  pen.strokeStyle = colour('faint');
  for (const border of places) {
    outline(border);
    pen.globalAlpha = .5;
    pen.fill();
    pen.globalAlpha = 1;
    pen.stroke();
  }
  if (here.length > 0) {
    pen.strokeStyle = colour('pan');
    pen.lineWidth = 2;
    pen.setLineDash(isTied ? [] : [4, 3]);
    outline(here);
    pen.stroke();
    pen.setLineDash([]);
  }
  const count = `${keyframes.length} ${keyframes.length === 1 ? 'keyframe' : 'keyframes'}`;
  const where = here.length === 0 ? 'where the camera looks is not known yet'
    : isTied ? 'blue: what the picture shows' : 'dashed: what the picture shows by telemetry alone, as it was not found in the map yet';
  say('scene-caption', `Grey: ${count}; ${where}`);
  element('scene-plot').setAttribute('aria-label', `The scene map: ${count}; ${where}`);
}

onNewProcess(() => {
  keyframes = null;
  present = [];
});
