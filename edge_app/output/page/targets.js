// The newest targets, and where each was before.
// A place is as the plan has it: metres on the ground, degrees on the sphere.

import {element} from './elements.js';
import {kDegree} from './numbers.js';
import {onEvent, onNewProcess} from './stream.js';

const kTrail = 400;      // places a target

export let targets = null;      // the newest
export let trails = new Map();  // by identity: where it was, as the plan has it

const place = (target) => target.position_m ?? (target.azimuth_rad === null ? null : [target.azimuth_rad * kDegree, target.elevation_rad * kDegree]);

function onTargets(fresh) {
  targets = fresh;
  element('targets').hidden = element('boxes-choice').hidden = false;
  const there = new Set(fresh.targets.map((one) => one.identity));
  for (const identity of trails.keys()) if (!there.has(identity)) trails.delete(identity);
  for (const target of fresh.targets) {
    const at = place(target);
    if (!at) continue;
    const trail = trails.get(target.identity) ?? [];
    trail.push(at);
    if (trail.length > kTrail) trail.shift();
    trails.set(target.identity, trail);
  }
}

onEvent('targets', onTargets);
onNewProcess(() => {
  targets = null;
  trails.clear();
});
