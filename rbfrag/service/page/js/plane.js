/** The plane of the design chart: which measure runs across, which values are shown and asked. */

import { ratios } from "./numbers.js";
import { quantityNamed } from "./vocabulary.js";

/**
 * @typedef {string} Across the measure that runs across: pgv, pga, pgd or one such as sa(1)
 * @typedef {{across: Across, x: [number, number], y: [number, number], perKr: number, p2: number,
 *   xEdges: number[], yEdges: number[]}} Plane
 *   x and y are the ranges shown, y being the toppling velocity [m/s]; perKr is y over k_r at this
 *   p2; the edges are ends of the fitted ranges
 */

/** @type {Record<string, [number, number]>} */
const PLAIN = { pgv: [0.05, 3], pgd: [0.003, 3] };
/** @type {[number, number]} */
const PLAIN_ACCELERATION = [0.03, 3];
const PLAIN_Y = [0.02, 3];
const MARGIN = 1.35;
const BEYOND = 1.06;
const GRID = 57;
const CURVE = 121;
const BESIDE = 1e-6;

/** Ratio within which a value counts as within a range: fields hold three digits. */
const ROUNDING = 1.01;

/**
 * Name and unit of a measure.
 * @param {Across} across
 */
export function labelOf(across) {
  const { axis, unit } = quantityNamed(across);
  return { name: axis, unit, title: `${axis} [${unit}]` };
}

/**
 * The plane on which an answer is shown.
 *
 * Factors come from the answer itself: its toppling velocity over the k_r that was asked, its
 * intensity over the measure that was asked.
 * @param {any} answer of /v1/predict
 * @param {Record<string, number>} block what predictions read of it: p2 and kr of one that topples
 * @param {Record<string, number>} measures by name
 * @param {Record<string, [number, number]>} domain of the model, by variable
 * @param {Plane | null} before the plane whose ranges stay, while the point is moved; else null
 * @returns {Plane}
 */
export function planeOf(answer, block, measures, domain, before) {
  const across = acrossOf(answer, measures);
  const x = measures[across] ?? NaN;
  // the intensity of these terms is in proportion to the measure that they begin with
  const perX = answer.term.startsWith(across) ? answer.intensity_m_s / x : NaN;
  const xEdges = (domain.intensity_m_s ?? []).map((v) => v / perX);
  if (across === "pgv" && answer.pgv_over_pga_s) {
    const ratioPerX = answer.pgv_over_pga_s / x;
    xEdges.push(...(domain.pgv_over_pga_s ?? []).map((v) => v / ratioPerX));
  }
  return {
    across,
    x: around(before?.across === across ? before.x : (PLAIN[across] ?? PLAIN_ACCELERATION), x),
    y: around(before?.y ?? PLAIN_Y, answer.y_m_s),
    perKr: answer.y_m_s / block.kr,
    p2: block.p2,
    xEdges: xEdges.filter((v) => v > 0 && Number.isFinite(v)),
    yEdges: [...(domain.y_m_s ?? [])],
  };
}

/**
 * The values across at which the chart asks.
 * @param {Plane} plane
 */
export function columnsOf(plane) {
  return lines(plane.x, plane.xEdges, GRID);
}

/**
 * The values across at which a curve asks.
 * @param {Plane} plane
 */
export function stepsOf(plane) {
  return lines(plane.x, plane.xEdges, CURVE);
}

/**
 * The toppling velocities at which the chart asks.
 * @param {Plane} plane
 */
export function rowsOf(plane) {
  return lines(plane.y, plane.yEdges, GRID);
}

/**
 * Lines at equal ratios, a little beyond the range, and on both sides of each edge: so the
 * boundary between answers in and out of the fitted range is drawn where it is.
 * @param {[number, number]} range
 * @param {number[]} edges
 * @param {number} count
 */
function lines([low, high], edges, count) {
  const from = low / BEYOND;
  const to = high * BEYOND;
  const nearEdges = edges
    .filter((edge) => edge > from && edge < to)
    .flatMap((edge) => [edge * (1 - BESIDE), edge, edge * (1 + BESIDE)]);
  return [...ratios(from, to, count), ...nearEdges].sort((a, b) => a - b);
}

/**
 * The measure that runs across: PGV where the model uses it, else the first that it uses.
 * @param {any} answer of /v1/predict
 * @param {Record<string, number>} measures by name
 * @returns {Across}
 */
function acrossOf({ term, kind }, measures) {
  if (term.startsWith("pgd")) return "pgd";
  // PGV is optional in the model of PGA of free-standing blocks
  if (term.startsWith("pgv") || (kind === "rocking" && "pgv" in measures)) return "pgv";
  return (term === "sa" && Object.keys(measures).find((name) => name.startsWith("sa("))) || "pga";
}

/**
 * A range, wider if the value lies outside it.
 * @param {number[]} range
 * @param {number} value
 * @returns {[number, number]}
 */
function around([low, high], value) {
  if (!(value > 0)) return [low, high];
  return [
    value < low / ROUNDING ? value / MARGIN : low,
    value > high * ROUNDING ? value * MARGIN : high,
  ];
}
