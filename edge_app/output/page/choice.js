// Choosing a pixel of the live picture by click, tap or keyboard: its direction is asked for, and it is marked.
// marker.js keeps the mark and says the direction.

import {postJson} from './api.js';
import {element} from './elements.js';
import {frozen} from './freeze.js';
import {cross, forgetDirection, mark, moveCross, sayMarker} from './marker.js';
import {drawPicture, picture} from './picture.js';
import {sayReference} from './reference.js';
import {record} from './stream.js';

async function choose(u, v) {
  if (!picture) return;
  const {frame} = picture;
  const shown = frozen ?? record;
  let answer;
  try {
    const {directions} = await postJson('/api/v1/direction', {frame, pixels: [[u, v]]});
    [answer] = directions;
  } catch (error) {
    answer = {error: error.message};
  }
  if (answer.error) {
    forgetDirection(`No direction: ${answer.error}`);
  } else {
    // One shown pixel is what a click is off by, beside what the direction is.
    const click = picture.overlay.width / element('picture').clientWidth / shown.focal_length_px;
    mark(frame, u, v, answer, click);
    sayMarker(picture.overlay);
    sayReference(answer, shown.localized !== null);
  }
  drawPicture();
}

element('picture').addEventListener('click', (event) => {
  if (!picture) return;
  const box = element('picture').getBoundingClientRect();
  const scale = picture.overlay.width / box.width;
  choose((event.clientX - box.left) * scale, (event.clientY - box.top) * scale);
});

element('picture').addEventListener('keydown', (event) => {
  if (!picture || event.ctrlKey || event.altKey || event.metaKey) return;
  const {width, height} = picture.overlay;
  const ways = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  if (!cross) moveCross([width / 2, height / 2]);
  const [u, v] = cross;
  if (event.key in ways) {
    const step = width / (event.shiftKey ? 10 : 100);
    const [du, dv] = ways[event.key];
    moveCross([Math.min(width, Math.max(0, u + step * du)), Math.min(height, Math.max(0, v + step * dv))]);
    drawPicture();
  } else if (event.key === 'Enter' || event.key === ' ') {
    choose(u, v);
  } else {
    return;
  }
  event.preventDefault();
});
element('picture').addEventListener('blur', () => {
  moveCross(null);
  drawPicture();
});
