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

/** What blocks do, by the failure that an answer is about. */
const VERBS = { toppling: "topple", overturning: "overturn" };

/**
 * What a block does that fails as an answer says.
 * @param {{failure?: string}} answer
 */
export function verbOf({ failure = "toppling" }) {
  return VERBS[/** @type {keyof typeof VERBS} */ (failure)] ?? "fail";
}

/**
 * What a probability, its interval and the range of one earthquake mean, in counts of blocks.
 * @param {{probability: number, ci_low: number, ci_high: number, event_low: number | null,
 *   event_high: number | null, level: number, failure?: string}} answer
 * @returns {string}
 */
export function inWords(answer) {
  const { probability: p, ci_low: low, ci_high: high, event_low, event_high, level } = answer;
  if (p === 0 && high === 0) return "No earthquake motion with this shaking makes the block fail.";
  const of = [100, 1000, 10000].find((n) => p * n >= 1 && (1 - p) * n >= 1) ?? 10000;
  const among = of.toLocaleString("en").replace(",", "\u202f");
  return (
    `Of ${among} such blocks ${count(p, of)} ${verbOf(answer)}, over all earthquakes and sites with this ` +
    `shaking; as far as the data tell it, between ${count(low, of, true)} and ` +
    `${count(high, of, true)}.` +
    (event_low === null || event_high === null
      ? ""
      : ` In one single earthquake, between ${count(event_low, of, true)} and ` +
        `${count(event_high, of, true)} ${verbOf(answer)}.`) +
    ` (Both ranges ${percent(level)}.)`
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
