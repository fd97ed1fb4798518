/** What the reader asks: block, shaking and model, as texts named like the options. */

import { forField, fromField, plain } from "./numbers.js";

/**
 * @typedef {"rectangle" | "numbers" | "angles" | "fractures"} Shape how the block is given
 * @typedef {Record<string, string>} Values texts of the fields by name; kind is "" for a block that is
 *   backed by a slope, or the name of another
 * @typedef {{shape: Shape, values: Values}} Question
 */

export const BLOCK_FIELDS = {
  rectangle: ["height", "width", "dip", "phi", "water"],
  numbers: ["p2", "kr"],
  angles: ["alpha1", "alpha3", "r3", "beta", "phi", "water"],
  fractures: ["s1", "s2", "gamma", "beta", "phi", "water"],
};

/** Standard deviations of the fields of a shape, which only its probability is asked with. */
export const ERROR_FIELDS = {
  rectangle: ["height_sigma", "width_sigma", "dip_sigma", "phi_sigma"],
  numbers: [],
  angles: ["alpha1_sigma", "alpha3_sigma", "r3_sigma", "beta_sigma", "phi_sigma"],
  fractures: ["s1_sigma", "s2_sigma", "gamma_sigma", "beta_sigma", "phi_sigma"],
};

/** By which of its fields an address names a shape. */
const OWN_FIELDS = /** @type {[Shape, string[]][]} */ ([
  ["angles", ["alpha1", "alpha3", "r3"]],
  ["fractures", ["s1", "s2", "gamma"]],
  ["numbers", ["p2", "kr"]],
]);

/** Of the shaking, what stands in the part of the form that is closed at first. */
export const FURTHER = ["tm", "pgd", "sa", "arias", "magnitude"];

export const MEASURES = ["pgv", "pga", ...FURTHER];

export const MODEL_FIELDS = ["model", "level", "sites"];

/** A block in each of its descriptions, and a strong shaking. */
export const DEFAULTS = {
  height: "2",
  width: "0.5",
  dip: "6",
  p2: "3",
  kr: "0.1",
  alpha1: "-15",
  alpha3: "24",
  r3: "2.5",
  s1: "4.5",
  s2: "1.6",
  gamma: "85",
  beta: "18",
  phi: "",
  water: "",
  ...Object.fromEntries(Object.values(ERROR_FIELDS).flat().map((name) => [name, ""])),
  kind: "",
  restitution: "",
  displacement: "0.1",
  pgv: "0.6",
  pga: "",
  tm: "",
  pgd: "",
  sa: "",
  arias: "",
  magnitude: "",
  model: "",
  level: "0.95",
  sites: "",
};

/** Friction of a block that is no rectangle, of which it must be known [deg]. */
export const USUAL_PHI = "38";

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

/** The name of a spectral acceleration: sa(1) for that at 1 s. */
const SPECTRAL = /^sa\((.+)\)$/;

/**
 * Spectral accelerations by period, as texts: of "0.3=0.9 1=0.5" those at 0.3 and 1 s.
 * @param {string} text
 * @returns {Values}
 */
export function spectrumIn(text) {
  const items = text.split(/\s+/).filter(Boolean);
  return Object.fromEntries(
    items.map((item) => item.split(/[=:]/)).map(([period, value = ""]) => [String(Number(period)), value]),
  );
}

/**
 * The measures of a question by name, each spectral acceleration by its own.
 * @param {Values} values
 * @returns {Record<string, number>}
 */
export function measuresOf(values) {
  const { sa = "", ...others } = only(values, MEASURES);
  const texts = Object.entries(spectrumIn(sa)).map(([period, text]) => [`sa(${period})`, text]);
  return Object.fromEntries(
    [...Object.entries(others), ...texts].map(([name, text]) => [name, fromField(text)]),
  );
}

/**
 * The values in which one measure is another.
 * @param {Values} values
 * @param {string} name
 * @param {number} measure
 * @returns {Values}
 */
export function withMeasure(values, name, measure) {
  const period = SPECTRAL.exec(name)?.[1];
  if (period === undefined) return { ...values, [name]: forField(measure) };
  const spectrum = Object.entries({ ...spectrumIn(values.sa), [period]: forField(measure) });
  spectrum.sort(([one], [other]) => Number(one) - Number(other));
  return { ...values, sa: spectrum.map((item) => item.join("=")).join(" ") };
}

/**
 * Measures as the body of a request has them: spectral accelerations by period.
 * @param {Record<string, any>} measures by name
 * @returns {Record<string, any>}
 */
export function sentMeasures(measures) {
  /** @type {Record<string, any>} */
  const sent = {};
  for (const [name, value] of Object.entries(measures)) {
    const period = SPECTRAL.exec(name)?.[1];
    if (period === undefined) sent[name] = value;
    else sent.sa = { ...sent.sa, [period]: value };
  }
  return sent;
}

/**
 * What describes the block, as the operations on its shape are asked.
 * @param {Question} question
 * @returns {Values}
 */
export function blockOf({ shape, values }) {
  const block = only(values, blockFields({ shape, values }));
  return values.kind ? { ...block, no_back: "true" } : block;
}

/**
 * The fields that describe the block; no water stands behind one that is free-standing.
 * @param {Question} question
 */
function blockFields({ shape, values }) {
  return BLOCK_FIELDS[shape].filter((name) => !(values.kind && name === "water"));
}

/**
 * Everything that is asked, and nothing that is not.
 * @param {Question} question
 * @returns {Values}
 */
export function asked({ shape, values }) {
  const free = values.kind ? ["kind", "restitution"] : [];
  const errors = ERROR_FIELDS[shape];
  const names = [...blockFields({ shape, values }), ...errors, ...free, "displacement", ...MEASURES, ...MODEL_FIELDS];
  const given = only(values, names);
  for (const name of /** @type {const} */ (["level", "displacement"])) {
    if (given[name] === DEFAULTS[name]) delete given[name];
  }
  return given;
}

/**
 * The question an address holds, with defaults for what it leaves out.
 *
 * An address that names any measure leaves the other measures unknown, and so it is with what
 * describes the block.
 * @param {URLSearchParams} query
 * @returns {Question}
 */
export function fromQuery(query) {
  /** @type {Values} */
  const values = { ...DEFAULTS };
  const has = (/** @type {string[]} */ names) => names.some((name) => query.has(name));
  /** @type {Shape} */
  const shape = OWN_FIELDS.find(([, names]) => has(names))?.[0] ?? "rectangle";
  if (has(MEASURES)) values.pgv = "";
  if (has(BLOCK_FIELDS[shape])) for (const name of BLOCK_FIELDS[shape]) values[name] = "";
  for (const [name, text] of query) if (name in values) values[name] = plain(text);
  // the option of the API and the command line for a block that stands free
  if (query.get("no_back") === "true") values.kind = "rocking";
  return { shape, values };
}

/**
 * The query that an address needs to ask the same.
 * @param {Question} question
 * @returns {string}
 */
export function toQuery(question) {
  return new URLSearchParams(asked(question)).toString();
}
