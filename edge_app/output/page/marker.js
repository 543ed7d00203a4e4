// The pixel that was chosen, and its direction: the mark stays with the scene while the camera turns.
// And the cross that the keyboard moves over the picture. All pixels are px of the frame.

import {postJson} from './api.js';
import {element, say} from './elements.js';
import {degrees, small} from './numbers.js';
import {onNewProcess} from './stream.js';

export let marker = null;  // {frame, direction, pixel, sigma}: what was chosen, and where it is now; pixel null: unknown
export let cross = null;   // [u, v], while the keyboard moves it

export function moveCross(to) {
  cross = to;
}

// answer: of POST /api/v1/direction; click: rad that one shown pixel is, by which a choice may be off.
export function mark(frame, u, v, answer, click) {
  marker = {frame, direction: answer.direction, pixel: [u, v], sigma: Math.hypot(answer.sigma_rad, click)};
  say('azimuth', degrees(answer.azimuth_rad, 5));
  say('elevation', degrees(answer.elevation_rad, 5));
  say('sigma', small(answer.sigma_rad));
  say('pixel', `${u.toFixed(1)}, ${v.toFixed(1)}`);
  // To all digits, for programs.
  Object.assign(element('pointing').dataset, {frame, u, v, azimuth: answer.azimuth_rad, elevation: answer.elevation_rad, sigma: answer.sigma_rad});
}

export function forgetDirection(hint) {
  marker = null;
  for (const id of ['azimuth', 'elevation', 'sigma', 'pixel']) say(id, '\u2013');
  const {dataset} = element('pointing');
  for (const key of Object.keys(dataset)) delete dataset[key];
  say('pointing-hint', hint);
}

// Where the chosen direction is in another frame.
export async function followMarker(frame) {
  const followed = marker;
  if (!followed) return;
  const answer = await postJson('/api/v1/pixel', {frame, directions: [followed.direction]}).catch(() => null);
  followed.pixel = answer?.pixels[0].pixel ?? null;
}

export function sayMarker({width, height}) {
  if (!marker) return;
  const [u, v] = marker.pixel ?? [-1, -1];
  const inside = u >= 0 && u <= width && v >= 0 && v <= height;
  say('pointing-hint', `Of frame ${marker.frame}; ${inside ? 'the cross stays with it.' : 'it is out of the picture now.'}`);
}

// scale: shown pixels to one of the frame.
export function drawMarker(pen, scale) {
  if (marker?.pixel) drawCross(pen, marker.pixel[0] * scale, marker.pixel[1] * scale, 14);
  if (cross && document.activeElement === element('picture')) drawCross(pen, cross[0] * scale, cross[1] * scale, 22);
}

function drawCross(pen, u, v, size) {
  pen.beginPath();
  for (const [du, dv] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    pen.moveTo(u + .3 * size * du, v + .3 * size * dv);
    pen.lineTo(u + size * du, v + size * dv);
  }
  pen.lineWidth = 4;
  pen.strokeStyle = '#000a';
  pen.stroke();
  pen.lineWidth = 2;
  pen.strokeStyle = '#ffe14d';
  pen.stroke();
}

onNewProcess(() => forgetDirection('Click or tap the picture: the direction of that pixel.'));
