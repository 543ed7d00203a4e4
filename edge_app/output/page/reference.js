// From what azimuth and elevation are counted, in words below them.
// True north is known only if the ground plane (tracking.plane) has an origin on Earth.

import {getJson} from './api.js';
import {say} from './elements.js';
import {kDegree, withSigma} from './numbers.js';
import {onNewProcess} from './stream.js';

const kFromPlatform = 'the platform\u2019s forward axis, where pan is 0';
const kFromScene = 'the forward axis of the scene map\u2019s base';
const kNoNorth = 'Nothing says where true north is.';

let north = null;  // what the plane says of north, in words; null: not asked yet

async function askForNorth() {
  const {origin, heading} = await getJson('/api/v1/plane');
  if (!origin) return kNoNorth;
  const turned = (heading.value + 2 * Math.PI) % (2 * Math.PI);
  return `That axis points ${withSigma(turned, heading.sigma, kDegree, '\u00b0')} clockwise from true north.`;
}

// answer: of POST /api/v1/direction; tied: its frame is in the scene map's base.
export async function sayReference(answer, tied) {
  // Only answers with a plane are worth the question.
  if (answer.plane && north === null) north = await askForNorth().catch(() => null);
  say('reference', `Azimuth: from ${tied ? kFromScene : kFromPlatform}; positive to the right. Elevation: positive upwards. ${north ?? kNoNorth}`);
}

onNewProcess(() => { north = null; });
