// Targets over the live picture: box, error ellipse and name.
// Boxes first, then names, so that no box is drawn over a name.

import {chooseFree, ellipse, labelsOf, seenLastFirst, targetColour} from './target_names.js';

export function drawTargets(pen, list, scale) {
  pen.textAlign = 'left';
  pen.textBaseline = 'bottom';
  for (const target of list) {
    if (!target.box) continue;
    const {u, v, width, height} = target.box;
    const [long, short, turn] = ellipse(target.covariance_px2);
    pen.lineWidth = 2;
    pen.strokeStyle = targetColour(target.identity);
    pen.strokeRect(u * scale, v * scale, width * scale, height * scale);
    pen.beginPath();
    pen.ellipse(target.pixel[0] * scale, target.pixel[1] * scale, long * scale, short * scale, turn, 0, 2 * Math.PI);
    pen.stroke();
  }
  // Over all boxes: above its own, or below.
  const kHeight = 15;
  const {clientWidth, clientHeight} = pen.canvas;
  const places = seenLastFirst(list.filter((one) => one.box)).map((target) => {
    const {u, v, height} = target.box;
    return labelsOf(target).flatMap((text) => {
      const width = pen.measureText(text).width + 6;
      const left = Math.min(Math.max(0, u * scale), Math.max(0, clientWidth - width));
      return [Math.max(1, v * scale - 1 - kHeight), (v + height) * scale + 1].map((top) =>
        ({text, left, right: left + width, top, bottom: top + kHeight}));
    });
  });
  for (const {text, left, right, top, bottom} of chooseFree(places, {left: 0, right: clientWidth, top: 0, bottom: clientHeight})) {
    pen.fillStyle = '#000b';
    pen.fillRect(left, top, right - left, bottom - top);
    pen.fillStyle = '#fff';
    pen.fillText(text, left + 3, bottom - 1);
  }
}
