// Colours, names and error ellipses of targets, and where a name finds room.
// Names never overlap. A name without room is left out; the table has it.

const kEllipse = 2.45;  // sigmas of a place that hold 95 %

export const targetColour = (identity) => `hsl(${(250 + identity * 137.5) % 360} 90% 55%)`;
export const targetName = ({identity, class: name}) => `#${identity}${name ? ` ${name}` : ''}`;

// Half axes and turn of a covariance's ellipse.
export function ellipse([[a, b], [, c]]) {
  const middle = (a + c) / 2;
  const half = Math.hypot((a - c) / 2, b);
  return [kEllipse * Math.sqrt(Math.max(0, middle + half)), kEllipse * Math.sqrt(Math.max(0, middle - half)), Math.atan2(2 * b, a - c) / 2];
}

// What a target is called where there is room, and at worst.
export const labelsOf = (target) => [...new Set([targetName(target), `#${target.identity}`])];
export const seenLastFirst = (list) => [...list].sort((a, b) => b.seen_s - a.seen_s);

// The first of each one's places that lies in the field and on none before; those without are left out, as the table has them.
export function chooseFree(places, field) {
  const taken = [];
  const isFree = (one) => one.left >= field.left && one.right <= field.right && one.top >= field.top && one.bottom <= field.bottom &&
    !taken.some((other) => one.left < other.right && one.right > other.left && one.top < other.bottom && one.bottom > other.top);
  for (const some of places) {
    const free = some.find(isFree);
    if (free) taken.push(free);
  }
  return taken;
}
