// The button that stores the live streams as a recording, and how far the recording is.
// Hidden unless output.recordings names a directory.

import {postJson} from './api.js';
import {element, say} from './elements.js';
import {isNumber} from './numbers.js';

let isUnderWay = false;

// recording: of /api/v1/status.
export function showRecording(recording) {
  element('recordings').hidden = recording === null;
  if (recording === null) return;
  isUnderWay = recording.under_way;
  say('record', isUnderWay ? 'End' : 'Record');
  element('record-seconds').disabled = isUnderWay;
  if (recording.directory === null) return;
  const {directory, frames, samples: angles, length_s: length, asked_s: asked, left_out: leftOut, error} = recording;
  const stored = `${frames} frames and ${angles} samples of telemetry` + (leftOut > 0 ? `, ${leftOut} frames left out` : '');
  if (!isUnderWay) {
    say('recorded', `${directory}: ${length.toFixed(1)} s, ${stored}.` + (error === null ? '' : ` Ended early: ${error}.`));
  } else if (frames === 0) {
    say('recorded', `${directory}: waiting for a key frame.`);
  } else {
    say('recorded', `${directory}: ${length.toFixed(0)} of ${asked} s, ${stored}.`);
  }
}

element('record').addEventListener('click', async () => {
  const seconds = element('record-seconds').valueAsNumber;
  try {
    if (!isUnderWay && !isNumber(seconds)) throw new Error('how many seconds?');
    showRecording(isUnderWay ? await postJson('/api/v1/recording/end', {}) : await postJson('/api/v1/recording', {duration_s: seconds}));
  } catch (error) {
    say('recorded', `Not done: ${error.message}.`);
  }
});
