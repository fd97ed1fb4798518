/** What the reader asks: block, shaking and model, as texts named like the options. */

/**
 * @typedef {"numbers" | "angles" | "fractures"} Shape how the block is given
 * @typedef {Record<string, string>} Values texts of the fields by name; no_back is "true" or "", kind
 *   is "" for a block that is backed by a slope, or the name of another
 * @typedef {{shape: Shape, values: Values}} Question
 */

export const BLOCK_FIELDS = {
  numbers: ["p2", "kr"],
  angles: ["alpha1", "alpha3", "r3", "beta", "phi", "no_back"],
  fractures: ["s1", "s2", "gamma", "beta", "phi", "no_back"],
};

export const SPECTRAL = ["sa03_g", "sa10_g", "sa20_g", "sa30_g"];

export const MEASURES = ["pgv", "pga", "tm", "pgd", ...SPECTRAL];

export const MODEL_FIELDS = ["model", "level"];

/** Names of what is said of a block that is not backed by a slope. */
const FREE_FIELDS = ["kind", "restitution"];

/** The same block of some 2.5 m in its three descriptions, and a strong shaking. */
export const DEFAULTS = {
  p2: "3",
  kr: "0.1",
  alpha1: "-15",
  alpha3: "24",
  r3: "2.5",
  s1: "4.5",
  s2: "1.6",
  gamma: "85",
  beta: "18",
  phi: "38",
  no_back: "",
  kind: "",
  restitution: "",
  pgv: "0.6",
  pga: "",
  tm: "",
  pgd: "",
  sa03_g: "",
  sa10_g: "",
  sa20_g: "",
  sa30_g: "",
  model: "",
  level: "0.95",
};

/**
 * Some of the values.
 * @param {Values} values
 * @param {string[]} names
 * @returns {Values}
 */
export function only(values, names) {
  return Object.fromEntries(
    names.filter((name) => values[name] !== "").map((name) => [name, values[name]]),
  );
}

/**
 * Names of what says how the block stands; none where a slope backs it.
 * @param {Values} values
 */
export function standing(values) {
  return values.kind ? FREE_FIELDS : [];
}

/**
 * Everything that is asked, and nothing that is not.
 * @param {Question} question
 * @returns {Values}
 */
export function asked({ shape, values }) {
  const names = [...BLOCK_FIELDS[shape], ...standing(values), ...MEASURES, ...MODEL_FIELDS];
  return only(values, names);
}

/**
 * The question an address holds, with defaults for what it leaves out.
 *
 * An address that names any measure leaves the other measures unknown.
 * @param {URLSearchParams} query
 * @returns {Question}
 */
export function fromQuery(query) {
  /** @type {Values} */
  const values = { ...DEFAULTS };
  if (MEASURES.some((name) => query.has(name))) values.pgv = "";
  for (const [name, text] of query) if (name in values) values[name] = text;
  const has = (/** @type {string[]} */ names) => names.some((name) => query.has(name));
  /** @type {Shape} */
  let shape = "numbers";
  if (values.kind) return { shape, values };
  if (has(["alpha1", "alpha3", "r3"])) shape = "angles";
  else if (has(["s1", "s2", "gamma"])) shape = "fractures";
  return { shape, values };
}

/**
 * The query that an address needs to ask the same.
 * @param {Question} question
 * @returns {string}
 */
export function toQuery(question) {
  const given = asked(question);
  if (given.level === DEFAULTS.level) delete given.level;
  return new URLSearchParams(given).toString();
}
