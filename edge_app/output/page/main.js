// Starts the page: what is drawn when, and the loops that ask the server.
// The README of this folder says how its files become one page.

import {showStatusForEver} from './health.js';
import {drawHour, showHourForEver} from './hour.js';
import {showLink} from './link.js';
import {showManualLink} from './manual.js';
import {drawPicture, showPicturesForEver} from './picture.js';
import {drawPlan} from './plan.js';
import {drawPlots} from './plots.js';
import {drawSceneMap} from './scene_map.js';
import {showRecord} from './state.js';
import {followForEver} from './stream.js';
import {drawTelemetryError} from './telemetry_error.js';
import {drawZoomCurve} from './zoom_curve.js';

function drawAll() {
  drawZoomCurve();
  drawTelemetryError();
  drawPlan();
  drawSceneMap();
  drawPlots();
}

function showAll() {
  showLink();
  if (!document.hidden) {
    showRecord();
    drawAll();
  }
}

setInterval(showAll, 250);
for (const event of ['resize', 'visibilitychange']) {
  window.addEventListener(event, () => {
    drawAll();
    drawHour();
    drawPicture();
  });
}
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  drawAll();
  drawHour();
});
drawAll();
drawHour();
showManualLink();
followForEver();
showPicturesForEver();
showStatusForEver();
showHourForEver();
