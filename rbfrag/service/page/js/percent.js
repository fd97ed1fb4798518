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
 * What a probability means, in counts of blocks.
 * @param {Answer} answer
 * @returns {string}
 */
export function inOneSentence(answer) {
  const { probability: p, ci_high: high } = answer;
  if (p === 1 && answer.how === "by mechanics") {
    return "The block is unstable without shaking: check dip and friction.";
  }
  if (p === 0 && high === 0) return "No earthquake motion with this shaking makes the block fail.";
  const of = among(p);
  return (
    `This block fails or stands: of ${grouped(of)} such cases, over all earthquakes and sites with ` +
    `shaking like this, ${about(p, of)} ${verbOf(answer)}.`
  );
}

/**
 * What its interval and the range at some sites of one earthquake mean.
 * @param {Answer} answer
 * @returns {string}
 */
export function ranges(answer) {
  const { probability: p, ci_low: low, ci_high: high, event_low, event_high, level } = answer;
  if ((p === 0 && high === 0) || low === 1) return "";
  const of = among(p);
  const between = (/** @type {number} */ a, /** @type {number} */ b) =>
    count(a, of) === count(b, of) ? count(a, of) : `between ${count(a, of)} and ${count(b, of)}`;
  const event =
    event_low === null || event_high === null
      ? ""
      : ` At ${atSites(answer)}, facing all sides, ${percent(event_low)} to ${percent(event_high)} of ` +
        `such blocks ${verbOf(answer)}.`;
  const each = event ? "Each " : "";
  return `As far as the data tell, it is ${between(low, high)}.${event} (${each}${percent(level)}.)`;
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
  const [p, low, high] = [drained.probability, drained.ci_low, drained.ci_high].map((value) =>
    percent(Number(value)),
  );
  return `Drained, without water pressure: ${strength.join("")}P${GAP}=${GAP}${p} (${low} to ${high}).`;
}

/**
 * Which sites the range of one earthquake is of.
 * @param {{sites?: number | null}} answer
 */
export function atSites({ sites }) {
  return `${sites} site${sites === 1 ? "" : "s"} of one earthquake`;
}

/**
 * Of how many blocks a share is a count that tells something.
 * @param {number} p
 */
function among(p) {
  return [100, 1000, 10000].find((n) => p * n >= 1 && (1 - p) * n >= 1) ?? 10000;
}

/** @type {(p: number, of: number) => string} */
function about(p, of) {
  const text = count(p, of);
  return /\d$/.test(text) && !text.startsWith("fewer") ? `about ${text}` : text;
}

/**
 * @param {number} p
 * @param {number} of
 */
function count(p, of) {
  const n = Math.round(p * of);
  if (n === 0 && p > 0) return "fewer than 1";
  if (n === of && p < 1) return "almost all";
  return grouped(n);
}

/** @param {number} n */
function grouped(n) {
  return n.toLocaleString("en").replace(",", "\u202f");
}
