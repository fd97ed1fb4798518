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
  if (p < SMALLEST) return `<0.01${GAP}%`;
  if (p > 1 - SMALLEST) return `>99.99${GAP}%`;
  if (p < 0.0995) return `${(100 * p).toPrecision(2)}${GAP}%`;
  if (p < 0.995) return `${Math.round(100 * p)}${GAP}%`;
  return `${Number((100 * p).toFixed(2))}${GAP}%`;
}

/** What blocks do, by the kind of an answer. */
const VERBS = {
  toppling: "topple",
  rocking: "overturn",
  sliding: "slide too far",
  slumping: "slump",
  confined_toppling: "topple",
};

/**
 * What a block does that fails as an answer says.
 * @param {{kind: string}} answer
 */
export function verbOf({ kind }) {
  return VERBS[/** @type {keyof typeof VERBS} */ (kind)] ?? "fail";
}

/**
 * @typedef {{kind: string, probability: number, ci_low: number, ci_high: number,
 *   event_low: number | null, event_high: number | null, level: number, how: string,
 *   sites?: number | null}} Answer
 */

/**
 * An interval in percent: 7.4–26 %.
 * @param {number} low
 * @param {number} high
 */
export function interval(low, high) {
  const ends = [low, high].map((end) => percent(end).replace(`${GAP}%`, ""));
  return `${[...new Set(ends)].join("\u2013")}${GAP}%`;
}

/**
 * The confidence interval of an answer, or why there is none.
 * @param {Answer} answer
 * @returns {string}
 */
export function inOneSentence(answer) {
  const { probability: p, ci_low: low, ci_high: high, level } = answer;
  if (p === 1 && answer.how === "by mechanics") {
    return "The block is unstable without shaking: check dip and friction.";
  }
  if (p === 0 && high === 0) return "By mechanics: this shaking cannot make the block fail.";
  return `${percent(level)} confidence interval ${interval(low, high)}`;
}

/**
 * The prediction interval at some sites of one earthquake; empty where it is not asked for.
 * @param {Answer} answer
 * @returns {string}
 */
export function ranges(answer) {
  const { event_low, event_high, level } = answer;
  if (event_low === null || event_high === null) return "";
  return (
    `At ${atSites(answer)}, ${interval(event_low, event_high)} of the blocks ${verbOf(answer)} ` +
    `(${percent(level)} prediction interval).`
  );
}

/** Yields of a block, by their keys. */
const YIELDS = { kr: "k_r", ky: "k_y", ks: "k_s", kct: "k_ct" };

/**
 * What the answer is without the pressure of the water behind the block; empty for a dry block.
 * @param {{drained?: Record<string, number | null> | null}} answer
 */
export function drainedBound({ drained }) {
  if (!drained) return "";
  const strength = Object.entries(YIELDS)
    .filter(([key]) => typeof drained[key] === "number")
    .map(([key, symbol]) => `${symbol}${GAP}=${GAP}${Number(Number(drained[key]).toPrecision(3))}, `);
  const ends = interval(Number(drained.ci_low), Number(drained.ci_high));
  const p = percent(Number(drained.probability));
  return `Drained: ${strength.join("")}P${GAP}=${GAP}${p} (${ends}), without water pressure.`;
}

/**
 * Which sites the range of one earthquake is of.
 * @param {{sites?: number | null}} answer
 */
export function atSites({ sites }) {
  return `${sites} site${sites === 1 ? "" : "s"} of one earthquake`;
}
