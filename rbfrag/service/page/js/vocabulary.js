/** Quantities as the service declares them: labels, units and ranges of fields, names of terms. */

import { get } from "./ask.js";
import { writeText } from "./subscripts.js";

/**
 * @typedef {{above: number | null, least: number | null, below: number | null,
 *   most: number | null}} Range
 * @typedef {{parameters: string[], label: string, description: string, unit: string,
 *   symbol: string, range: Range, axis: string}} Quantity as /v1/vocabulary describes it
 */

/** @type {Quantity} */
const UNKNOWN = {
  ...{ parameters: [], label: "", description: "", unit: "", symbol: "", axis: "" },
  range: { above: null, least: null, below: null, most: null },
};

/** @type {Map<string, Quantity>} */
const quantities = new Map();
/** @type {Map<string, string>} */
const terms = new Map();
/** @type {Promise<void> | null} */
let loading = null;

/** Load the vocabulary, once, and label the fields of the page. */
export function loadVocabulary() {
  loading ??= load().catch((error) => {
    loading = null;
    throw error;
  });
  return loading;
}

async function load() {
  const vocabulary = await get("v1/vocabulary");
  for (const { name, label } of vocabulary.terms) terms.set(name, label);
  for (const quantity of /** @type {Quantity[]} */ (vocabulary.quantities)) {
    for (const id of quantity.parameters) {
      quantities.set(id, quantity);
      labelField(id, quantity);
    }
  }
}

/**
 * The quantity of a parameter of requests, or a spectral acceleration by its name: sa(1).
 * @param {string} parameter
 */
export function quantityNamed(parameter) {
  const period = /^sa\((.+)\)$/.exec(parameter)?.[1];
  if (period === undefined) return quantities.get(parameter) ?? UNKNOWN;
  const axis = `spectral acceleration, SA(${period} s), 5 % damping`;
  return { ...UNKNOWN, axis, unit: "g", symbol: `SA(${period} s)` };
}

/**
 * The title of an axis of a parameter.
 * @param {string} parameter
 */
export function titleOf(parameter) {
  const about = quantityNamed(parameter);
  return `${withSymbol(about)} [${about.unit}]`;
}

/** @type {(quantity: Quantity) => string} */
function withSymbol({ label, symbol }) {
  return symbol && !label.split(" ").includes(symbol) ? `${label} ${symbol}` : label;
}

/**
 * The measures that the models of a term use.
 * @param {string} term
 */
export function labelOfTerm(term) {
  return terms.get(term) ?? term;
}

/** @type {(id: string, quantity: Quantity) => void} */
function labelField(id, quantity) {
  const { description, unit, range } = quantity;
  const element = /** @type {HTMLElement | null} */ (document.querySelector(`label[for="${id}"]`));
  if (!element) return;
  writeText(element, withSymbol(quantity));
  element.title = description;
  const help = document.getElementById(`${id}-help`);
  if (help) help.textContent = `${description}.`;
  const place = document.getElementById(`${id}-unit`);
  if (place) place.textContent = unit.replace("deg", "°") || rangeInWords(range);
}

/** @param {Range} range */
function rangeInWords({ above, least, below, most }) {
  const [low, high] = [above ?? least, below ?? most];
  return low === null || high === null || high > 1 ? "" : `${low}–${high}`;
}
