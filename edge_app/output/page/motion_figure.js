// The motion that helps a calibration next, as a drawing: the frame is what the camera sees, arrows are how it should turn.
// Its words are those of `needs` (words.js). What no motion helps has no drawing.

import {element, say} from './elements.js';
import {kNeeds} from './words.js';

const kEight = 'M80 45C110 8 146 20 146 45S110 82 80 45S14 20 14 45S50 82 80 45';
const kFigures = {
  'move the camera': {way: [kEight]},
  'pan more': {both: ['M8 45H152']},
  'tilt more': {both: ['M80 4V86']},
  'accelerate': {way: ['M12 30H146', 'M146 45H86', 'M86 60H146', 'M146 75H40']},
  'move farther on both axes': {both: ['M8 45H152', 'M80 4V86']},
  'change speed and direction more and faster': {way: ['M12 30H146', 'M146 45H86', 'M86 60H146', 'M146 75H40']},
  'move faster while the image is read out': {way: ['M30 45H142'], line: ['M12 33H54', 'M12 57H54', 'M30 24H72', 'M30 66H72']},
  'let landmarks cross the whole image': {both: ['M46 22 114 68', 'M114 22 46 68']},
  'more of the same motion': {way: [kEight]},
};

// An SVG element; attributes only, as the page's policy wants it.
export function svg(name, attributes, ...children) {
  const made = document.createElementNS(element('motion').namespaceURI, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

let figureShown = null;

export function showMotion(needs) {
  const figure = kFigures[needs];
  element('motion-figure').hidden = !figure;
  if (!figure || needs === figureShown) return;
  figureShown = needs;
  const arrows = (paths, ends) => (paths ?? []).map((d) => svg('path', {d, class: 'arrow', ...ends}));
  const end = {'marker-end': 'url(#arrow-head)'};
  element('motion').replaceChildren(
    svg('defs', {}, svg('marker', {id: 'arrow-head', viewBox: '0 0 8 8', refX: 6, refY: 4, markerWidth: 5, markerHeight: 5, orient: 'auto-start-reverse'},
      svg('path', {d: 'M0 0 8 4 0 8Z', class: 'head'}))),
    svg('rect', {x: 40, y: 18, width: 80, height: 54, class: 'frame'}),
    ...arrows(figure.line, {}), ...arrows(figure.way, end), ...arrows(figure.both, {...end, 'marker-start': 'url(#arrow-head)'}));
  element('motion').setAttribute('aria-label', `Drawing: ${needs}`);
  say('motion-caption', kNeeds[needs]);
}
