// Links and losses: the table of what /api/v1/status says.
// links is what the newest status said of video and pan/tilt; null: none came yet.

import {getJson} from './api.js';
import {showCalibrationInUse} from './calibration.js';
import {rows, say} from './elements.js';
import {isNumber} from './numbers.js';
import {showProgress} from './progress.js';
import {showRecording} from './recording.js';
import {showSceneMap} from './scene_map.js';
import {connected} from './stream.js';
import {duration, sleep} from './time.js';

const kStatusInterval = 2000;  // ms

export let links = null;

function describeLink(link) {
  const state = link.connected
    ? [isNumber(link.rate_hz) ? `${link.rate_hz.toPrecision(3)} a second` : 'connected', link.reason ?? []].flat().join('; ')
    : link.reason ?? 'not connected yet';
  const age = link.age_s === null ? '' : link.age_s < 2 ? '; newest now' : `; newest ${duration(link.age_s)} old`;
  return `${state}${age}; back again ${link.reconnections} times`;
}

function describeDelay({state, delay_s: delay, sigma_s: sigma, age_s: age}, milliseconds) {
  if (state === 'calibrated') return 'calibrated through this connection';
  const off = `${milliseconds(Math.abs(delay))} ms ${delay < 0 ? 'earlier' : 'later'}, \u00b1 ${milliseconds(sigma)} ms`;
  return state === 'open' ? `${off}; open for ${duration(age)}: turn the camera` : `${off}; found ${duration(age)} ago`;
}

function describeSceneMap({landmarks, ready, pictures, last, upkeep}) {
  if (!ready) return 'its index is being made';
  const newest = last ? `; last ${last.status}, ${duration(last.age_s)} ago` : '';
  const changes = upkeep === null ? '' : `; ${upkeep.born} born, ${upkeep.died} died${upkeep.stopped ? ', not kept up any more' : ''}`;
  return `${landmarks} landmarks; found in ${pictures.found} of ${pictures.looked_at} pictures${newest}${changes}`;
}

function detectorRows(detectors) {
  if (!detectors) return [];
  const {replaced, ...kinds} = detectors;
  return [
    ...Object.entries(kinds).filter(([, counters]) => counters).map(([name, {pictures, unjudged, boxes}]) => {
      return [`Detector ${name}`, `${pictures - unjudged} pictures judged, ${unjudged} not; ${boxes} boxes`];
    }),
    ['Pictures that detectors left out', String(replaced)],
  ];
}

function showStatus(status) {
  links = status.links;
  say('camera', status.camera);
  say('health-caption', `alidade ${status.alidade}, running for ${duration(status.uptime_s)}; counts are since the start`);
  const {frames, dropped, video_faults: faultsOfVideo, video_clock: clock, link_delay: delay, latency_s: latency, page_faults: faults, streams, http} = status;
  const milliseconds = (seconds) => isNumber(seconds) ? String(Number((1000 * seconds).toPrecision(3))).replace('-', '\u2212') : '\u2013';
  rows('health', [
    ['Video link', describeLink(links.video)],
    ['Pan/tilt link', describeLink(links.pan_tilt)],
    ['Frames', String(frames.received)],
    ['OE, PT, no orientation', `${frames.oe}, ${frames.pt}, ${frames.none}`],
    ['Damaged, not fetched in time', `${frames.damaged}, ${frames.not_fetched}`],
    ['Untrue time stamps, foreign packets, stray bytes', `${faultsOfVideo.unstamped}, ${faultsOfVideo.foreign_packets}, ${faultsOfVideo.garbage_bytes}`],
    ['Dropped frames, readings, records', `${dropped.frames}, ${dropped.telemetry}, ${dropped.records}`],
    ['Pictures too late to look at', `${dropped.late_pictures}`],
    ['Clock filter of the video', `${clock.locked ? 'locked' : 'warming up'}, \u00b1 ${milliseconds(clock.sigma_s)} ms`],
    ['Its restarts, steps of the delay', `${clock.restarts}, ${clock.floor_shifts}`],
    ...(delay ? [['Telemetry against the calibration', describeDelay(delay, milliseconds)]] : []),
    ['Frame beyond the newest trusted angle', `${milliseconds(status.telemetry_age_s)} ms`],
    ['Latency p50, p90, p99, max',
      latency === null ? 'not measured' : `${['p50', 'p90', 'p99', 'max'].map((one) => milliseconds(latency[one])).join(', ')} ms`],
    ...(status.scene_map ? [['Scene map', describeSceneMap(status.scene_map)]] : []),
    ['Page faults, minor and major', `${faults.minor}, ${faults.major}`],
    ['Stream readers, records lost', `${streams.clients.length}, ${streams.lost_records}`],
    ['Requests, refused', `${http.requests}, ${http.refused}`],
    ...detectorRows(status.detectors),
  ]);
}

export async function showStatusForEver() {
  for (;;) {
    if (connected && !document.hidden) {
      try {
        const status = await getJson('/api/v1/status');
        showStatus(status);
        showProgress(status.calibration);
        showRecording(status.recording);
        await showCalibrationInUse(status);
        await showSceneMap(status);
      } catch {
        // The header says that the link is away; the next round asks again.
      }
    }
    await sleep(kStatusInterval);
  }
}
