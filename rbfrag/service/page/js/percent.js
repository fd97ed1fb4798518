/** Probabilities in percent, on axes and in tables of the page. */

const SMALLEST = 1e-4;
const GAP = "\u00a0";

/**
 * A probability in percent, with the digits that distinguish it from 0 and 1.
 * @param {number} p
 * @returns {string}
 */
export function percent(p) {
  if (p === 0) return `0${GAP}%`;
  if (p === 1) return `100${GAP}%`;
  if (p < SMALLEST) return `<0.01${GAP}%`;
  if (p > 1 - SMALLEST) return `>99.99${GAP}%`;
  if (p < 0.0995) return `${(100 * p).toPrecision(2)}${GAP}%`;
  if (p < 0.995) return `${Math.round(100 * p)}${GAP}%`;
  return `${Number((100 * p).toFixed(2))}${GAP}%`;
}

/**
 * An interval in percent: 7.4–26 %.
 * @param {number} low
 * @param {number} high
 */
export function interval(low, high) {
  const ends = [low, high].map((end) => percent(end).replace(`${GAP}%`, ""));
  return `${[...new Set(ends)].join("\u2013")}${GAP}%`;
}
