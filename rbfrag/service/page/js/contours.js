/** Lines of equal probability between the answers of the service on a grid. */

import { d3 } from "./d3.js";

export const LEVELS = [0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99];

/** Levels whose line is drawn bolder. */
export const BOLD = [0.05, 0.5, 0.95];

/** Log-odds at which probabilities that are 0 or 1 are cut off: between points, log-odds run
 * straighter than probabilities. */
const CUT = 12;

/** Where labels stand, in turn: the sum of their distances from the left and lower edge. */
const DIAGONALS = [0.62, 0.86, 1.1, 1.34];

/** Room that a label takes, in pixels. */
export const LABEL = [38, 16];

/**
 * @typedef {{xs: number[], ys: number[], probability: (number | null)[], in_domain: boolean[]}} Grid
 *   answers row by row: those for the first y come first
 */

/**
 * The areas where the probability is at least that of each level, as paths.
 * @param {Grid} grid
 * @param {any} x scale
 * @param {any} y scale
 * @returns {{level: number, path: string, points: number[][]}[]}
 */
export function areasAbove(grid, x, y) {
  const values = grid.probability.map((p) => (p === null ? NaN : logOdds(p)));
  return contoursOf(grid, values, LEVELS.map(logOdds), x, y).map((each, i) => ({
    level: LEVELS[i],
    ...each,
  }));
}

/**
 * The area outside the fitted range, as a path.
 * @param {Grid} grid
 * @param {any} x scale
 * @param {any} y scale
 * @returns {string}
 */
export function areaOutside(grid, x, y) {
  const values = grid.in_domain.map((inside) => (inside ? 0 : 1));
  return contoursOf(grid, values, [0.5], x, y)[0].path;
}

/**
 * Where the labels stand: where a level's line crosses a falling diagonal of the plot. A label that
 * would touch another stands on another diagonal, or is left out; the bold lines have theirs first.
 * @param {{level: number, points: number[][]}[]} areas
 * @param {any} x scale
 * @param {any} y scale
 * @param {(at: number[]) => boolean} free whether nothing else is drawn at a place
 * @returns {{level: number, at: number[]}[]}
 */
export function labelsOf(areas, x, y, free) {
  const [left, right] = x.range();
  const [bottom, top] = y.range();
  const order = [...areas.entries()].sort(
    ([, a], [, b]) => Number(BOLD.includes(b.level)) - Number(BOLD.includes(a.level)),
  );
  /** @type {{level: number, at: number[]}[]} */
  const found = [];
  for (const [number, { level, points }] of order) {
    for (let turn = 0; turn < DIAGONALS.length; turn += 1) {
      const wanted = DIAGONALS[(number + turn) % DIAGONALS.length];
      const at = crossing(points, wanted);
      if (!at || !free(at) || found.some((each) => touch(at, each.at))) continue;
      found.push({ level, at });
      break;
    }
  }
  return found;

  /** @type {(points: number[][], wanted: number) => number[] | null} */
  function crossing(points, wanted) {
    let best = null;
    let least = 0.05;
    for (const [px, py] of points) {
      const across = (px - left) / (right - left);
      const up = (py - bottom) / (top - bottom);
      if (across < 0.06 || across > 0.94 || up < 0.04 || up > 0.96) continue;
      const distance = Math.abs(across + up - wanted);
      if (distance < least) [least, best] = [distance, [px, py]];
    }
    return best;
  }
}

/**
 * Whether two labels with these centres would touch.
 * @type {(a: number[], b: number[]) => boolean}
 */
export function touch(a, b) {
  return Math.abs(a[0] - b[0]) < LABEL[0] && Math.abs(a[1] - b[1]) < LABEL[1];
}

/** @param {number} p */
function logOdds(p) {
  return Math.max(-CUT, Math.min(CUT, Math.log(p / (1 - p))));
}

/**
 * @param {Grid} grid
 * @param {number[]} values
 * @param {number[]} thresholds
 * @param {any} x
 * @param {any} y
 * @returns {{path: string, points: number[][]}[]}
 */
function contoursOf(grid, values, thresholds, x, y) {
  const across = grid.xs.map((v) => x(v));
  const up = grid.ys.map((v) => y(v));
  const size = [across.length, up.length];
  const areas = d3.contours().size(size).thresholds(thresholds)(values);
  return areas.map((/** @type {any} */ area) => {
    /** @type {number[][]} */
    const points = [];
    let path = "";
    for (const polygon of area.coordinates) {
      for (const ring of polygon) {
        const placed = ring.map((/** @type {number[]} */ [i, j]) => [
          between(across, i - 0.5),
          between(up, j - 0.5),
        ]);
        points.push(...placed);
        const corners = placed.map((/** @type {number[]} */ at) => at.map((v) => v.toFixed(2)));
        path += `M${corners.join("L")}Z`;
      }
    }
    return { path, points };
  });
}

/**
 * Value of a list at a place between two of its elements.
 * @param {number[]} list
 * @param {number} place
 */
function between(list, place) {
  const at = Math.max(0, Math.min(list.length - 1, place));
  const low = Math.min(Math.floor(at), list.length - 2);
  return list[low] + (at - low) * (list[low + 1] - list[low]);
}
