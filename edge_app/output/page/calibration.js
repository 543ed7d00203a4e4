// The calibration in use as a table, with its standard deviations.
// Asked for anew only when a record shows that it is another.

import {getJson} from './api.js';
import {rows, say} from './elements.js';
import {isNumber, withSigma} from './numbers.js';
import {onNewProcess, record, startId} from './stream.js';
import {duration} from './time.js';
import {showTelemetryError} from './telemetry_error.js';
import {showZoomCurve} from './zoom_curve.js';

export const kParameters = [
  ['focal_length', 'Focal length', 1, 'px'],
  ['aspect', 'Aspect', 1, ''],
  ['radial_distortion', 'Radial distortion', 1, ''],
  ['line_delay', 'Line delay', 1e6, '\u00b5s/row'],
  ['pan_axis', 'Pan axis off down (x, y)', 1e3, 'mrad', [0, 1]],
  ['tilt_axis', 'Tilt axis off right (x, z)', 1e3, 'mrad', [0, 2]],
  ['pan_scale', 'Pan scale', 1, ''],
  ['tilt_scale', 'Tilt scale', 1, ''],
  ['clock_offset', 'Clock offset', 1e3, 'ms'],
];

function showCalibration(calibration) {
  const entries = [];
  for (const [key, name, scale, unit, which] of kParameters) {
    const parameter = calibration[key];
    if (!parameter) continue;
    const value = which ? which.map((i) => parameter.value[i]) : parameter.value;
    entries.push([name, withSigma(value, parameter.sigma, scale, unit)]);
  }
  if (isNumber(calibration.holds_beyond_m))
    entries.push(['Holds for things farther than', `${Number(calibration.holds_beyond_m.toPrecision(2))} m`]);
  if (isNumber(calibration.zoom)) entries.push(['Zoom', String(calibration.zoom)]);
  rows('calibration', entries);
  showZoomCurve(calibration.zoom_curve ?? null);
  showTelemetryError(calibration);
}

let calibrationSeen = null;  // which calibration is shown

export async function showCalibrationInUse(status) {
  if (!record) return;
  const key = record.calibrated ? [startId, record.focal_length_px, record.radial_distortion, record.line_delay_s].join() : '';
  if (key !== calibrationSeen) {
    if (record.calibrated) {
      showCalibration(await getJson('/api/v1/calibration'));
    } else {
      rows('calibration', [['Focal length', `${record.focal_length_px} px`]]);
      showZoomCurve(null);
      showTelemetryError({});
    }
    calibrationSeen = key;
  }
  say('calibration-caption', record.calibrated
    ? `in use for ${duration(status.calibration.age_s)}; \u00b1 one standard deviation` : 'none in use: values of the data sheet, or of the one that was withdrawn');
}

onNewProcess(() => { calibrationSeen = null; });
