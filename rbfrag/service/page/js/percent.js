/** Probabilities in numbers and in plain words. */

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
  if (p < SMALLEST) return `<${GAP}0.01${GAP}%`;
  if (p > 1 - SMALLEST) return `>${GAP}99.99${GAP}%`;
  if (p < 0.1) return `${Number((100 * p).toPrecision(2))}${GAP}%`;
  if (p <= 0.99) return `${Math.round(100 * p)}${GAP}%`;
  const missing = Number((100 * (1 - p)).toPrecision(2));
  const decimals = missing >= 0.1 ? 2 : 3;
  return `${Number((100 - missing).toFixed(decimals))}${GAP}%`;
}

/**
 * What a probability and its interval mean, in a count of motions.
 * @param {{probability: number, ci_low: number, ci_high: number, level: number}} answer
 * @returns {string}
 */
export function inWords(answer) {
  const { probability: p, ci_low: low, ci_high: high, level } = answer;
  if (p === 0 && high === 0) return "No earthquake motion with this shaking topples the block.";
  const of = [100, 1000, 10000].find((n) => p * n >= 1 && (1 - p) * n >= 1) ?? 10000;
  const among = of.toLocaleString("en").replace(",", "\u202f");
  return (
    `Of ${among} earthquake motions with this shaking, ${count(p, of)} topple the block. ` +
    `Between ${count(low, of, true)} and ${count(high, of, true)} is what the fitted data allow ` +
    `(${percent(level)} confidence).`
  );
}

/**
 * @param {number} p
 * @param {number} of
 * @param {boolean} [bare] without "about"
 */
function count(p, of, bare = false) {
  const n = Math.round(p * of);
  if (n === 0 && p > 0) return "fewer than 1";
  if (n === of && p < 1) return "almost all";
  const text = n.toLocaleString("en").replace(",", "\u202f");
  return bare ? text : `about ${text}`;
}
