// The button that asks for a fresh calibration, and what the server answers.
// What is in use stays meanwhile.

import {postJson} from './api.js';
import {element, say} from './elements.js';

element('anew').addEventListener('click', async () => {
  try {
    const {note} = await postJson('/api/v1/calibrate', {});
    say('anew-said', `A fresh calibration is under way: ${note}.`);
  } catch (error) {
    say('anew-said', `Not begun: ${error.message}.`);
  }
});
