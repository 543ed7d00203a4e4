// How far a calibration is, while there is none or a fresh one is wanted: a row for each parameter that decides, what
// motion helps, and what was seen so far. Hidden otherwise.

import {kParameters} from './calibration.js';
import {showCoverage} from './coverage.js';
import {element, say} from './elements.js';
import {svg, showMotion} from './motion_figure.js';
import {isNumber} from './numbers.js';

// The place on a bar of 100, on a logarithmic scale from a hundredth of what is wanted to a hundred times as much.
const onBar = (ratio) => 50 + 25 * Math.min(2, Math.max(-2, Math.log10(ratio)));

function parameterRow({name, sigma, wanted, reached}) {
  const [, title, scale, unit] = kParameters.find(([key]) => key === name) ?? [name, name, 1, ''];
  const shown = (value) => isNumber(value) ? `${Number((value * scale).toPrecision(2))}${unit ? `\u00a0${unit}` : ''}` : '\u2013';
  const row = document.createElement('tr');
  const head = document.createElement('th');
  head.scope = 'row';
  head.textContent = title;
  const [present, goal, bar] = [shown(sigma), shown(wanted), ''].map((text) => {
    const cell = document.createElement('td');
    cell.textContent = text;
    return cell;
  });
  const size = isNumber(sigma) ? Math.max(2, onBar(sigma / wanted)) : 0;
  bar.append(svg('svg', {viewBox: '0 0 100 12', preserveAspectRatio: 'none', class: 'bar', role: 'img',
    'aria-label': isNumber(sigma) ? `${Number((sigma / wanted).toPrecision(2))} times what is wanted${reached ? ': reached' : ''}` : 'not known yet'},
  svg('rect', {x: 0, y: 3, width: size, height: 6, class: reached ? 'good' : 'fair'}),
  svg('path', {d: `M${onBar(1)} 0V12`, class: 'limit'})));
  row.append(head, present, goal, bar);
  return row;
}

let progressShown = '';  // a table that is the same is left alone

export function showProgress({needs, progress}) {
  element('progress').hidden = !progress;
  if (!progress) return;
  const text = JSON.stringify(progress.parameters);
  if (text !== progressShown) element('progress-rows').replaceChildren(...progress.parameters.map(parameterRow));
  progressShown = text;
  const attempts = progress.attempts === 1 ? '1 attempt' : `${progress.attempts || 'no'} attempts${progress.attempts ? '' : ' yet'}`;
  say('progress-caption', `${attempts}; ${Math.round(progress.span_s)} s of motion are at hand`);
  say('refusal', progress.refusal ?? '');
  showMotion(needs);
  showCoverage(progress.coverage, progress.asked_range_rad);
}
