// Landmarks over the live picture, with magnified residuals and their scale; points that are followed to calibrate.
// sayLandmarks() counts them in words below the picture.

import {niceStep} from './canvas.js';
import {say} from './elements.js';

let lastMagnification = null;

function magnificationOf(landmarks, shownPerPixel) {
  const lengths = landmarks.filter((one) => one.used).map((one) => Math.hypot(one.du, one.dv)).sort((a, b) => a - b);
  if (lengths.length === 0) return lastMagnification;
  const wanted = 14 / Math.max(1e-3, lengths[Math.floor(.8 * lengths.length)] * shownPerPixel);
  // Keeps its step until it is clearly another.
  if (lastMagnification === null || wanted < .5 * lastMagnification || wanted > 2.5 * lastMagnification) {
    const power = 10 ** Math.floor(Math.log10(wanted));
    lastMagnification = Math.max(1, power * [1, 2, 5].filter((one) => one * power <= wanted).pop());
  }
  return lastMagnification;
}

// scale: shown pixels to one of the frame.
export function drawLandmarks({pen, height}, {landmarks, points}, scale) {
  const magnification = magnificationOf(landmarks, scale);
  pen.lineWidth = 1.25;
  for (const {u, v, du, dv, used} of landmarks) {
    pen.strokeStyle = used ? '#3dff7a' : '#ff5fa8';
    pen.beginPath();
    if (used) {
      pen.arc(u * scale, v * scale, 2.5, 0, 2 * Math.PI);
      pen.moveTo(u * scale, v * scale);
      pen.lineTo((u + du * magnification) * scale, (v + dv * magnification) * scale);
    } else {
      for (const way of [-1, 1]) {
        pen.moveTo(u * scale - 3, v * scale - 3 * way);
        pen.lineTo(u * scale + 3, v * scale + 3 * way);
      }
    }
    pen.stroke();
  }
  pen.fillStyle = '#5fd0ff';
  for (const [u, v] of points) pen.fillRect(u * scale - 1.5, v * scale - 1.5, 3, 3);
  if (landmarks.length > 0) drawScale(pen, height, magnification * scale);
}

// A bar in the lower left corner, and how many pixels of residual it stands for. shown: of one such pixel.
function drawScale(pen, height, shown) {
  const unit = niceStep(40 / shown, 1);
  const text = `${Number(unit.toPrecision(1))} px`;
  const long = unit * shown;
  pen.fillStyle = '#000b';
  pen.fillRect(6, height - 24, long + pen.measureText(text).width + 22, 18);
  pen.strokeStyle = '#3dff7a';
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(12, height - 15);
  pen.lineTo(12 + long, height - 15);
  pen.stroke();
  pen.fillStyle = '#fff';
  pen.textAlign = 'left';
  pen.textBaseline = 'middle';
  pen.fillText(text, 18 + long, height - 15);
}

export function sayLandmarks(frame, {landmarks, points}) {
  const used = landmarks.filter((one) => one.used);
  if (points.length > 0) {
    say('seen', `frame ${frame}: ${points.length} points followed, to calibrate with`);
  } else if (landmarks.length === 0) {
    say('seen', `frame ${frame}: no landmarks`);
  } else {
    const rms = Math.sqrt(used.reduce((sum, one) => sum + one.du ** 2 + one.dv ** 2, 0) / Math.max(1, used.length));
    say('seen', `frame ${frame}: ${used.length} landmarks used, ${landmarks.length - used.length} not; residual ${rms.toFixed(3)} px`);
  }
}
