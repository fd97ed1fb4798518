/** What the page asks the service, operation by operation. */

import { get, post, upload } from "./ask.js";
import { fromField } from "./numbers.js";
import { columnsOf, rowsOf, stepsOf } from "./plane.js";
import { BLOCK_FIELDS, MEASURES, only, standing } from "./question.js";
import { sizesFor, spectrumOf } from "./record.js";

/**
 * @typedef {import("./question.js").Question} Question
 * @typedef {import("./plane.js").Plane} Plane
 * @typedef {{p2: string, kr: string}} TwoNumbers as texts, so that the service reads what was typed
 */

/** Digits of the values of a grid: what is drawn does not show more, edges stay apart. */
const DIGITS = 9;

/**
 * Mode, yield and size of a block.
 * @param {Question} question
 */
export function askBlock({ shape, values }) {
  return get("v1/block", only(values, BLOCK_FIELDS[shape]));
}

/**
 * The lines of a drawing of a block.
 * @param {Question} question
 */
export function askDrawing({ shape, values }) {
  return get("v1/drawing", only(values, BLOCK_FIELDS[shape]));
}

/**
 * The probability that a block topples.
 * @param {TwoNumbers} block
 * @param {Question} question
 */
export function askProbability(block, { values }) {
  const names = [...standing(values), ...MEASURES, "model", "level"];
  return get("v1/predict", { ...block, ...only(values, names) });
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
 * @param {Question} question
 * @returns {Promise<import("./contours.js").Grid>}
 */
export async function askGrid(plane, model, { values }) {
  const [xs, ys] = [columnsOf(plane), rowsOf(plane)];
  const across = ys.flatMap(() => xs.map(rounded));
  const kr = ys.flatMap((y) => xs.map(() => rounded(y / plane.perKr)));
  const answer = await post("v1/predict", {
    p2: plane.p2,
    kr,
    ...standingOf(values),
    ...measuresOf(values),
    [plane.across]: across,
    model,
  });
  return { xs, ys, probability: answer.probability, in_domain: answer.in_domain };
}

/**
 * Probabilities of one block over the measure that runs across.
 * @param {Plane} plane
 * @param {string} model
 * @param {number} kr
 * @param {Question} question
 * @returns {Promise<import("./curve.js").Curve>}
 */
export async function askCurve(plane, model, kr, { values }) {
  const xs = stepsOf(plane);
  const answer = await post("v1/predict", {
    p2: plane.p2,
    kr,
    ...standingOf(values),
    ...measuresOf(values),
    [plane.across]: xs.map(rounded),
    model,
    level: fromField(values.level),
  });
  const { probability, ci_low, ci_high, event_low, event_high, in_domain } = answer;
  return { plane, xs, probability, ci_low, ci_high, event_low, event_high, in_domain };
}

/**
 * The toppling spectrum of a record in both polarities.
 * @param {File} file
 * @param {Record<string, string>} reading unit, sampling interval and trace, where needed
 * @param {number} p2 of the reader's block, or NaN
 */
export async function askSpectrum(file, reading, p2) {
  const query = { ...reading, polarity: "both", p2: sizesFor(p2).join(",") };
  return spectrumOf(await upload("v1/spectrum", query, file), file.name);
}

/** @param {Record<string, string>} values */
function standingOf(values) {
  const { kind, restitution } = only(values, standing(values));
  return restitution ? { kind, restitution: fromField(restitution) } : { kind };
}

/** @param {Record<string, string>} values */
function measuresOf(values) {
  return Object.fromEntries(
    Object.entries(only(values, MEASURES)).map(([name, text]) => [name, fromField(text)]),
  );
}

/** @param {number} value */
function rounded(value) {
  return Number(value.toPrecision(DIGITS));
}
