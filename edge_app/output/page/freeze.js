// Freezes the picture: it stays, and the server keeps the record of its frame, so that a click gives
// the direction in exactly this frame. One button freezes and releases; words say what is shown.

import {postJson} from './api.js';
import {element, say} from './elements.js';
import {followMarker, sayMarker} from './marker.js';
import {degrees} from './numbers.js';
import {drawPicture, keepPicture, picture} from './picture.js';
import {onNewProcess} from './stream.js';

export let frozen = null;  // the record of the frozen frame; null: the picture is live

let asking = false;  // the server is asked to keep a record

function sayFrozen(words) {
  say('picture-title', frozen ? 'Frozen picture' : 'Live picture');
  say('freeze', frozen ? 'Back to the live picture' : 'Freeze the picture');
  element('picture').classList.toggle('frozen', frozen !== null);
  say('frozen', words);
}

function release(words) {
  frozen = null;
  keepPicture(false);
  sayFrozen(words);
}

async function freeze() {
  if (!picture) return sayFrozen('There is no picture that could be frozen.');
  asking = true;
  keepPicture(true);
  const {frame, overlay} = picture;
  try {
    frozen = await postJson('/api/v1/hold', {frame});
    await followMarker(frame);
    sayMarker(overlay);
    sayFrozen(`Frozen at frame ${frame}: mode ${frozen.mode}, pan ${degrees(frozen.pan_rad)}, tilt ${degrees(frozen.tilt_rad)}. A click gives the direction in this frame.`);
    drawPicture();
  } catch (error) {
    release(`Not frozen: ${error.message}.`);
  } finally {
    asking = false;
  }
}

element('freeze').addEventListener('click', () => {
  if (asking) return;
  if (frozen) release('Live: the picture goes on.');
  else freeze();
});
onNewProcess(() => {
  if (frozen) release('Live: the program has begun anew, and has no record of the frozen frame.');
});
