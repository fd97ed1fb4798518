/** What the page asks the service, operation by operation. */

import { get, post, upload } from "./ask.js";
import { fromField } from "./numbers.js";
import { columnsOf, rowsOf, stepsOf } from "./plane.js";
import {
  blockOf,
  ERROR_FIELDS,
  MEASURES,
  measuresOf,
  MODEL_FIELDS,
  only,
  sentMeasures,
} from "./question.js";
import { SIZES, spectrumOf } from "./record.js";

/**
 * @typedef {import("./question.js").Question} Question
 * @typedef {import("./plane.js").Plane} Plane
 * @typedef {{kind: string, numbers: Record<string, number>}} Failing how a block fails, and what
 *   predictions read of it, as /v1/drawing says
 */

/** Most characters of the name of a record that the service takes. */
const LONGEST_NAME = 200;

/** Digits of the values of a grid: what is drawn does not show more, edges stay apart. */
const DIGITS = 9;

/**
 * The lines of a drawing of a block, how it fails and what predictions read of it.
 * @param {Question} question
 */
export function askDrawing(question) {
  return get("v1/drawing", blockOf(question));
}

/**
 * The probability that a block fails.
 * @param {Question} question
 * @param {string} kind how it fails
 */
export function askProbability(question, kind) {
  const { no_back, ...block } = blockOf(question);
  const free = question.shape === "numbers" ? {} : { no_back };
  const names = [...MEASURES, ...MODEL_FIELDS];
  return get("v1/predict", {
    ...{ ...block, ...free, kind },
    ...only(question.values, [...ERROR_FIELDS[question.shape], ...optionsOf(kind), ...names]),
    text: "true",
  });
}

/** The version of the service. */
export async function askVersion() {
  return (await get("v1/healthz")).version;
}

/** The fitted models with their fitted ranges. */
export function askModels() {
  return get("v1/models");
}

/**
 * Probabilities over the plane of the chart.
 * @param {Plane} plane
 * @param {string} model
 * @param {Failing} failing
 * @param {Question} question
 * @returns {Promise<import("./contours.js").Grid>}
 */
export async function askGrid(plane, model, failing, question) {
  const [xs, ys] = [columnsOf(plane), rowsOf(plane)];
  const across = ys.flatMap(() => xs.map(rounded));
  const kr = ys.flatMap((y) => xs.map(() => rounded(y / plane.perKr)));
  const answer = await post("v1/predict", {
    ...{ ...fixed(failing, question, { [plane.across]: across }), kr },
    model,
  });
  return { xs, ys, probability: answer.probability, in_domain: answer.in_domain };
}

/**
 * Probabilities of one block over the measure that runs across.
 * @param {Plane} plane
 * @param {string} model
 * @param {Failing} failing
 * @param {Question} question
 * @returns {Promise<import("./curve.js").Curve>}
 */
export async function askCurve(plane, model, failing, question) {
  const xs = stepsOf(plane);
  const answer = await post("v1/predict", {
    ...fixed(failing, question, { [plane.across]: xs.map(rounded) }),
    model,
    level: fromField(question.values.level),
    ...(question.values.sites === "" ? {} : { sites: fromField(question.values.sites) }),
  });
  const { probability, ci_low, ci_high, event_low, event_high, in_domain } = answer;
  return { plane, xs, probability, ci_low, ci_high, event_low, event_high, in_domain };
}

/**
 * The toppling spectrum of a record in both polarities.
 * @param {File} file
 * @param {Record<string, string>} reading unit, sampling interval and trace, where needed
 * @param {string} name under which it is shown
 */
export async function askSpectrum(file, reading, name) {
  const query = { ...spokenOf(reading, name), polarity: "both", p2: SIZES.join(",") };
  return spectrumOf(await upload("v1/spectrum", query, file), name);
}

/** A request for an answer with its text, in which the record has a name.
 * @type {(asked: Record<string, any>, name: string) => Record<string, any>} */
function spokenOf(asked, name) {
  return { ...asked, name: name.slice(0, LONGEST_NAME), text: "true" };
}

/** What the toppling spectrum says of a block, by polarity.
 * @type {(file: File, asked: Record<string, any>, name: string) => Promise<any[]>} */
export function askBounds(file, asked, name) {
  return upload("v1/spectrum", { ...spokenOf(asked, name), polarity: "both" }, file);
}

/** Whether a record topples a block by the certified search, by polarity.
 * @type {(file: File, asked: Record<string, any>, name: string) => Promise<any[]>} */
export function askCritical(file, asked, name) {
  const ways = [false, true].map((reverse) =>
    upload("v1/critical", { ...spokenOf(asked, name), reverse: String(reverse) }, file),
  );
  return Promise.all(ways);
}

/**
 * What else is said of a block that fails so.
 * @param {string} kind
 */
function optionsOf(kind) {
  return { rocking: ["restitution"], sliding: ["displacement"] }[kind] ?? [];
}

/**
 * What is alike in all questions of a figure: block, kind and measures, as numbers.
 * @param {Failing} failing
 * @param {Question} question
 * @param {Record<string, number[]>} across the measure that is not, by name
 */
function fixed({ kind, numbers }, { values }, across) {
  const { beta_deg: beta, ...block } = numbers;
  const texts = Object.entries(only(values, optionsOf(kind)));
  const options = Object.fromEntries(texts.map(([name, text]) => [name, fromField(text)]));
  const measures = sentMeasures({ ...measuresOf(values), ...across });
  return { ...block, ...(beta === undefined ? {} : { beta }), ...options, ...measures, kind };
}

/** @param {number} value */
function rounded(value) {
  return Number(value.toPrecision(DIGITS));
}
