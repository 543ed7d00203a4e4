// The stream of the server's events: the newest record, the records of the last minute, targets for whoever listens.
// It connects again for ever. What another module keeps of one process, it forgets by onNewProcess().

import {api, getJson, postJson} from './api.js';
import {isNumber} from './numbers.js';
import {now, sleep} from './time.js';
import {askForToken} from './token.js';

export const kMinute = 60;    // s, what the plots show
export const kStale = 2;      // s without a record
const kSilence = 20;          // s without a byte of the stream: it is dead

export let record = null;         // the newest
export let recordAt = -Infinity;  // when it came
export let connected = false;
export let startId = null;        // of the process at the other end
export let samples = [];          // of the last minute: {t, pan, tilt, residual, latency}

const forgets = [];         // called when another process answers
const readers = new Map();  // by the event's name

export const onNewProcess = (forget) => forgets.push(forget);
export const onEvent = (name, read) => readers.set(name, read);

function keep(sample) {
  samples.push(sample);
  const oldest = sample.t - kMinute;
  if (samples[0].t < oldest - 5) samples = samples.filter((one) => one.t >= oldest);
}

function onRecord(fresh) {
  record = fresh;
  recordAt = now();
  if (isNumber(fresh.time_s)) {
    keep({t: fresh.time_s, pan: fresh.pan_rad, tilt: fresh.tilt_rad, residual: fresh.residual_px,
      latency: fresh.latency_s});
  }
}

async function onHello(hello) {
  if (startId !== hello.start) {
    startId = hello.start;
    samples = [];
    for (const forget of forgets) forget();
  }
  // What this connection brings goes behind what was before it. The history is thinned out: its latencies are the
  // worst of many frames, and would not make a histogram.
  const before = samples;
  samples = [];
  const earlier = await getJson('/api/v1/history').then((history) => history.time_s.map((t, i) => ({
    t, pan: history.pan_rad[i], tilt: history.tilt_rad[i], residual: history.residual_px[i]}))).catch(() => before);
  const first = samples.length > 0 ? samples[0].t : Infinity;
  samples = earlier.filter((one) => isNumber(one.t) && one.t < first).concat(samples);
}

function readEvent(text) {
  let name = 'message';
  let data = '';
  for (const line of text.split('\n')) {
    if (line.startsWith('event: ')) name = line.slice(7);
    if (line.startsWith('data: ')) data += line.slice(6);
  }
  if (data === '') return;
  readers.get(name)?.(JSON.parse(data));
}

async function followStream() {
  const dead = new AbortController();
  let heardAt = now();
  const watch = setInterval(() => { if (now() - heardAt > kSilence) dead.abort(); }, 1000);
  try {
    const {ticket} = await postJson('/api/v1/stream/ticket', {});
    const response = await api(`/api/v1/stream?ticket=${ticket}`, {signal: dead.signal});
    connected = true;
    const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
    for (let rest = '';;) {
      const {value, done} = await reader.read();
      if (done) return;
      heardAt = now();
      const events = (rest + value).split('\n\n');
      rest = events.pop();
      events.forEach(readEvent);
    }
  } finally {
    clearInterval(watch);
    connected = false;
  }
}

export async function followForEver() {
  for (let pause = 250;; pause = Math.min(2 * pause, 4000)) {
    try {
      await followStream();
      pause = 250;
    } catch (error) {
      if (error.status === 401) {
        await askForToken();
        pause = 125;
        continue;
      }
      if (now() - recordAt < 5) pause = 250;
    }
    await sleep(pause);
  }
}

onEvent('orientation', onRecord);
onEvent('hello', onHello);
