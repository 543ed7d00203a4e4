// The ground plane from known points: pixels that were chosen, and where they are.
// The fit is the server's (POST /api/v1/plane/fit); nothing is stored.

import {postJson} from './api.js';
import {element, rows, say} from './elements.js';
import {marker} from './marker.js';
import {isNumber, kDegree, withSigma} from './numbers.js';
import {onNewProcess} from './stream.js';

let points = [];  // as POST /api/v1/plane/fit takes them

// NaN: not a number.
function decimal(id) {
  const text = element(id).value.trim().replace(',', '.');
  return text === '' ? NaN : Number(text);
}

// What was fitted to other points is no longer shown.
function changePoints(changed) {
  points = changed;
  showPoints();
  rows('ground-values', []);
  element('ground-file').hidden = true;
  element('ground-yaml').value = '';
}

function showPoints(misfits = []) {
  element('points').replaceChildren(...points.map((one) => {
    const row = document.createElement('tr');
    const name = document.createElement('th');
    name.scope = 'row';
    name.textContent = one.name;
    const where = document.createElement('td');
    const misfit = misfits.find((datum) => datum.kind === 'point' && datum.name === one.name)?.misfit;
    where.textContent = `${one.x_m}, ${one.y_m}, ${one.z_m} m${isNumber(misfit) ? `; misfit ${misfit.toFixed(2)} \u03c3` : ''}`;
    const drop = document.createElement('button');
    drop.type = 'button';
    drop.textContent = '\u00d7';
    drop.setAttribute('aria-label', `Remove ${one.name}`);
    drop.addEventListener('click', () => changePoints(points.filter((other) => other !== one)));
    where.append(drop);
    row.append(name, where);
    return row;
  }));
}

function addPoint() {
  const [x, y, z, sigma] = ['x', 'y', 'z', 'sigma'].map((key) => decimal(`point-${key}`));
  if (!marker) return say('ground-said', 'Choose a pixel of the picture first.');
  if (![x, y, z, sigma].every(Number.isFinite) || sigma <= 0) return say('ground-said', 'x, y, z and \u03c3 must be numbers, \u03c3 above 0.');
  const wanted = element('point-name').value.trim() || `point ${points.length + 1}`;
  const taken = (name) => points.some((one) => one.name === name);
  let name = wanted;
  for (let i = 2; taken(name); ++i) name = `${wanted} ${i}`;
  changePoints([...points, {name, direction: marker.direction, sigma_rad: marker.sigma, x_m: x, y_m: y, z_m: z, sigma_m: sigma}]);
  element('point-name').value = '';
  say('ground-said', '');
}

async function fitGround() {
  const data = {format: 1, points};
  const fields = ['ground-height', 'ground-height-sigma', 'ground-level'];
  const [height, heightSigma, level] = fields.map(decimal);
  if (fields.some((id) => element(id).value.trim() !== '' && !Number.isFinite(decimal(id)))) {
    return say('ground-said', 'Height, its \u03c3 and the level must be numbers, or empty.');
  }
  if (Number.isFinite(height) && !(heightSigma > 0)) return say('ground-said', 'The height needs a \u03c3 above 0.');
  if (Number.isFinite(height)) data.height = {height_m: height, sigma_m: heightSigma};
  if (Number.isFinite(level)) data.level = {sigma_deg: level};
  const fit = await postJson('/api/v1/plane/fit', data).catch((error) => ({message: error.message}));
  const fits = fit.degrees_of_freedom === 0 ? 'Fits, as it must: nothing checks it. Add a point.'
    : `Fits: residuals are ${fit.noise_scale?.toFixed(2)} of what their sigmas say, ${fit.degrees_of_freedom} more equations than unknowns.`;
  const north = fit.heading_of_base ? ' Nothing says where north is: y lies below the base\u2019s forward direction. Another point tells it.' : '';
  say('ground-said', fit.message || fits + north);
  showPoints(fit.data);
  const names = ['heading', 'pitch', 'roll', 'x', 'y', 'height'].filter((name) => fit[name]);
  rows('ground-values', names.map((name, i) => [name, withSigma([fit[name].value], [fit[name].sigma], i < 3 ? kDegree : 1, i < 3 ? '\u00b0' : 'm')]));
  element('ground-file').hidden = !fit.plane_yaml;
  element('ground-yaml').value = fit.plane_yaml ?? '';
}

element('point-add').addEventListener('click', addPoint);
element('ground-fit').addEventListener('click', fitGround);
onNewProcess(() => changePoints([]));  // the directions are of another process' base
