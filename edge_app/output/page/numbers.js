// Numbers as text: a true minus sign, no -0, a dash where there is none.
// withSigma() gives as many digits as the standard deviation is worth.

export const kDegree = 180 / Math.PI;

export const isNumber = (value) => typeof value === 'number' && Number.isFinite(value);

// Never -0.
export const fixed = (value, digits) => value.toFixed(digits).replace(/^-(?=[0.]*$)/, '').replace('-', '\u2212');
export const degrees = (radians, digits = 4) => isNumber(radians) ? `${fixed(radians * kDegree, digits)}\u00b0` : '\u2013';

export function small(radians) {
  if (!isNumber(radians)) return '\u2013';
  return radians < 1e-3 ? `${Number((radians * 1e6).toPrecision(3))} \u00b5rad` : `${Number((radians * 1e3).toPrecision(3))} mrad`;
}

// As many digits as the sigma is worth.
export function withSigma(value, sigma, scale, unit) {
  const values = [value].flat().map((one) => one * scale);
  const sigmas = [sigma ?? 0].flat().map((one) => one * scale);
  const text = values.map((one, i) => {
    const spread = sigmas[Math.min(i, sigmas.length - 1)];
    if (!(spread > 0)) return String(Number(one.toPrecision(7))).replace('-', '\u2212');
    const digits = Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(spread))));
    return `${fixed(one, digits)}\u00a0\u00b1\u00a0${spread.toFixed(digits)}`;
  }).join(', ');
  return unit ? `${text}\u00a0${unit}` : text;
}
