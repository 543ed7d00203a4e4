// Time as the page counts it: seconds since the page was opened, and pauses.
// Also a span of time in words.

import {isNumber} from './numbers.js';

export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
export const now = () => performance.now() / 1000;

export function duration(seconds) {
  if (!isNumber(seconds)) return '\u2013';
  if (seconds < 90) return `${Math.floor(seconds)} s`;
  if (seconds < 5400) return `${Math.floor(seconds / 60)} min`;
  return seconds < 172800 ? `${Math.floor(seconds / 3600)} h` : `${Math.floor(seconds / 86400)} days`;
}
