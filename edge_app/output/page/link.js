// The header's word on whether records come: live, late, lost, disconnected. Changes are announced to screen readers.
// Colours and greyed data follow from body's data-link (style.css).

import {say} from './elements.js';
import {connected, kStale, record, recordAt} from './stream.js';
import {now} from './time.js';
import {login} from './token.js';
import {kLost} from './words.js';

let linkState = 'waiting';

export function showLink() {
  const age = now() - recordAt;
  let text = '';
  let state = 'away';
  if (connected && record && age < kStale) {
    const [lost] = kLost[record.status] ?? [''];
    const oriented = record.mode !== 'none';
    state = oriented && !lost ? 'live' : oriented || !lost ? 'waiting' : 'lost';
    text = [oriented ? 'live' : lost ? '' : 'no orientation', lost].filter((one) => one).join(', ');
  } else if (connected && record) {
    state = 'stale';
    text = `no record for ${Math.floor(age)} s`;
  } else if (connected) {
    state = 'waiting';
    text = 'connected, no record yet';
  } else if (record) {
    text = `disconnected: data is ${Math.floor(age)} s old`;
  } else {
    text = login ? 'token needed' : 'connecting';
    state = 'waiting';
  }
  say('link', text);
  document.body.dataset.link = state;
  if (state !== linkState) {
    linkState = state;
    say('announce', {live: 'Live', stale: 'No records come', away: 'Disconnected, trying again'}[state] ?? text);
  }
}
