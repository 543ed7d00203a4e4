// What the newest record says: mode and why, needs of the calibration, angles and their standard deviations.
// Why a link is lost is told by the newest status.

import {element, say} from './elements.js';
import {links} from './health.js';
import {degrees} from './numbers.js';
import {record} from './stream.js';
import {kActivities, kLost, kModes, kNeeds, kWhy} from './words.js';

function whyNot(status) {
  const why = kWhy[status] ?? status;
  const reason = status in kLost ? links?.[kLost[status][1]].reason : null;
  return reason ? `${why.slice(0, -1)}: ${reason}` : why;
}

export function showRecord() {
  if (!record) return;
  say('mode', record.mode);
  element('mode').dataset.mode = record.mode;
  say('why', [kModes[record.mode] ?? '', whyNot(record.status)].join(' ').trim());
  const need = record.needs === null ? '' : kNeeds[record.needs] ?? `It needs: ${record.needs}.`;
  const activity = record.calibration === 'off' && !record.calibrated
    ? 'Not calibrated: the data sheet\u2019s values are used.' : kActivities[record.calibration] ?? record.calibration;
  say('calibrating', `${activity} ${need}`.trim());
  say('pan', degrees(record.pan_rad));
  say('tilt', degrees(record.tilt_rad));
  const sigma = record.orientation_sigma_rad;
  const [scale, unit] = sigma && Math.max(...sigma) >= 1e-3 ? [1e3, 'mrad'] : [1e6, '\u00b5rad'];
  say('orientation-sigma', sigma ? `${sigma.map((one) => Number((one * scale).toPrecision(2))).join(', ')} ${unit}` : '\u2013');
  say('landmark-count', String(record.landmarks));
}
