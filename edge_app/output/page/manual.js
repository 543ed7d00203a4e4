// The link to the manual: shown only if this program serves one.
// It is asked for as a followed link is: without the token.

import {element} from './elements.js';

export async function showManualLink() {
  const answer = await fetch('/manual/', {method: 'HEAD', cache: 'no-store', credentials: 'omit', redirect: 'error'}).catch(() => null);
  element('manual').hidden = answer?.status !== 200;
}
