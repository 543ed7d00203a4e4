// The buttons that store the live streams as a recording and verify it, and how far both are.
// Hidden unless output.recordings names a directory.

import {postJson} from './api.js';
import {element, say} from './elements.js';
import {isNumber} from './numbers.js';

let isUnderWay = false;

function describeVerification({state, sentence, report, error}) {
  if (state === 'running') return 'Verifying, with the time that the rest of the program leaves.';
  if (state === 'failed') return `Not verified: ${error}.`;
  return state === 'done' ? `${sentence[0].toUpperCase()}${sentence.slice(1)}. Report: ${report}` : '';
}

function describeRecording({under_way: goesOn, directory, frames, samples: angles, length_s: length, asked_s: asked, left_out: leftOut, error}) {
  const stored = `${frames} frames and ${angles} samples of telemetry` + (leftOut > 0 ? `, ${leftOut} frames left out` : '');
  if (!goesOn) return `${directory}: ${length.toFixed(1)} s, ${stored}.` + (error === null ? '' : ` Ended early: ${error}.`);
  return frames === 0 ? `${directory}: waiting for a key frame.` : `${directory}: ${length.toFixed(0)} of ${asked} s, ${stored}.`;
}

// recording: of /api/v1/status.
export function showRecording(recording) {
  element('recordings').hidden = recording === null;
  if (recording === null) return;
  isUnderWay = recording.under_way;
  say('record', isUnderWay ? 'End' : 'Record');
  element('record-seconds').disabled = isUnderWay;
  if (recording.directory !== null) say('recorded', describeRecording(recording));
  element('verify').hidden = isUnderWay || recording.frames === 0;
  element('verify').disabled = recording.verification.state === 'running';
  // Of an earlier recording it says nothing of this one.
  say('verified', recording.verification.recording === recording.directory ? describeVerification(recording.verification) : '');
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

element('verify').addEventListener('click', async () => {
  try {
    showRecording(await postJson('/api/v1/recording/verify', {}));
  } catch (error) {
    say('verified', `Not begun: ${error.message}.`);
  }
});
