// The live picture with all that is drawn over it, five times a second.
// Picture, landmarks, targets and the mark of the chosen pixel are of one frame.

import {api, ApiError, getJson, soon} from './api.js';
import {surface} from './canvas.js';
import {element, say} from './elements.js';
import {drawLandmarks, sayLandmarks} from './landmarks.js';
import {drawMarker, followMarker, sayMarker} from './marker.js';
import {showView} from './plan.js';
import {showPlaceInScene} from './scene_map.js';
import {connected, kStale, onNewProcess, record, recordAt} from './stream.js';
import {drawTargets} from './target_boxes.js';
import {targets} from './targets.js';
import {now, sleep} from './time.js';

const kPictureInterval = 200;  // ms

export let picture = null;  // {frame, bitmap, overlay, targets}

let kept = false;  // the picture stays as it is

export const keepPicture = (keep) => { kept = keep; };

export function drawPicture() {
  if (!picture) return;
  const {frame, bitmap, overlay} = picture;
  const shape = `${overlay.width} / ${overlay.height}`;
  if (element('picture').style.aspectRatio !== shape) element('picture').style.aspectRatio = shape;
  const drawn = surface('picture');
  if (!drawn) return;
  const {pen} = drawn;
  const scale = drawn.width / overlay.width;  // shown pixels to one of the frame
  pen.drawImage(bitmap, 0, 0, bitmap.width * overlay.scale * scale, bitmap.height * overlay.scale * scale);
  if (element('landmarks').checked) drawLandmarks(drawn, overlay, scale);
  if (picture.targets && element('boxes').checked) drawTargets(pen, picture.targets.targets, scale);
  drawMarker(pen, scale);
  sayLandmarks(frame, overlay);
}

async function showPicture() {
  const response = await api('/api/v1/picture', soon());
  const frame = Number(response.headers.get('X-Alidade-Frame'));
  const [bitmap, overlay] = await Promise.all([
    response.blob().then(createImageBitmap), getJson(`/api/v1/overlay?frame=${frame}`)]);
  if (!kept) await followMarker(frame);
  const told = targets ? await getJson(`/api/v1/targets?frame=${frame}`).catch(() => null) : null;
  if (told) await showView(frame, overlay);
  await showPlaceInScene(frame, overlay);
  if (kept) return bitmap.close();
  picture?.bitmap.close();
  picture = {frame, bitmap, overlay, targets: told};
  drawPicture();
  sayMarker(overlay);
}

export async function showPicturesForEver() {
  for (;;) {
    const began = performance.now();
    let pause = kPictureInterval;
    if (!kept && connected && !document.hidden && record && record.frame !== null && now() - recordAt < kStale) {
      try {
        await showPicture();
      } catch (error) {
        pause = 3000;
        if (error instanceof ApiError && error.status !== 401) say('seen', error.message);
      }
    }
    await sleep(Math.max(20, pause - (performance.now() - began)));
  }
}

onNewProcess(() => {
  picture = null;
  say('seen', 'no picture yet');
});
for (const id of ['landmarks', 'boxes']) element(id).addEventListener('change', drawPicture);
