/** The design chart: probability of toppling over shaking and block, with the reader's point. */

import { drawAxis, drawGrid, gridLines } from "./axes.js";
import { areaOutside, areasAbove, BOLD, LABEL, labelsOf, touch } from "./contours.js";
import { d3 } from "./d3.js";
import { quantity, readable } from "./numbers.js";
import { percent } from "./percent.js";
import { labelOf } from "./plane.js";
import { movable } from "./point.js";
import { sheetIn } from "./sheet.js";

/** How far from the point the middle of its label stands, in pixels. */
const BESIDE = 34;

export const MARGINS = { left: 62, right: 58, top: 10, bottom: 44 };

/**
 * @typedef {import("./plane.js").Plane} Plane
 * @typedef {{plane: Plane, x: number, kr: number, yIsFree: boolean, probability: number | null}} Spot
 *   the point: its measure across, its k_r, and whether that may be changed
 */

/**
 * Put a design chart into an element.
 * @param {HTMLElement} place
 * @param {{to: (x: number, kr: number | null) => void,
 *   by: (ratioOfX: number, ratioOfKr: number) => void}} moved called when the reader moves the
 *   point to a place, or by a step; k_r is null where it may not be changed
 */
export function designChart(place, moved) {
  /** @type {Spot | null} */
  let spot = null;
  /** @type {import("./contours.js").Grid | null} */
  let grid = null;
  const name = "Design chart: probability of toppling over shaking and toppling velocity";
  const sheet = sheetIn(place, name, MARGINS, (w) => Math.min(Math.max(0.62 * w, 320), 480), draw);
  const { svg, plot } = sheet();
  svg.attr("role", "group");
  const clip = svg.append("clipPath").attr("id", "chart-clip").append("rect");
  plot.append("rect").attr("class", "area");
  const inside = plot.append("g").attr("clip-path", "url(#chart-clip)");
  const parts = {
    bands: inside.append("g"),
    outside: inside.append("path").attr("class", "outside"),
    grid: inside.append("g"),
    lines: inside.append("g"),
    labels: inside.append("g"),
    guides: inside.append("g"),
    touch: plot.append("rect").attr("class", "touch"),
    bottom: plot.append("g"),
    left: plot.append("g"),
    right: plot.append("g"),
    point: plot.append("g").attr("class", "point"),
  };
  parts.point.append("circle").attr("class", "reach").attr("r", 22);
  parts.point.append("circle").attr("class", "ring").attr("r", 12);
  parts.point.append("circle").attr("class", "dot").attr("r", 7);
  parts.point.append("text").attr("dy", "0.34em");
  parts.point
    .attr("tabindex", 0)
    .attr("role", "slider")
    .attr("aria-label", "Point on the chart")
    .attr("display", "none");
  /** @type {{x: any, y: any} | null} */
  let scales = null;

  movable(
    parts.point.node(),
    parts.touch.node(),
    () =>
      ([px, py]) => {
        if (!spot || !scales) return;
        const { plane } = spot;
        const x = within(scales.x.invert(px), plane.x);
        const kr = spot.yIsFree ? within(scales.y.invert(py), plane.y) / plane.perKr : null;
        moved.to(x, kr);
      },
    ([byX, byY]) => {
      if (spot) moved.by(byX, spot.yIsFree ? byY : 1);
    },
    keepAnswerInSize,
  );

  function draw() {
    const s = sheet();
    const box = { x: s.left, y: s.top, width: s.right - s.left, height: s.bottom - s.top };
    for (const rect of [clip, plot.select(".area"), parts.touch]) {
      for (const [key, value] of Object.entries(box)) rect.attr(key, value);
    }
    if (!spot) return;
    const { plane } = spot;
    const x = d3.scaleLog(plane.x, [s.left, s.right]);
    const y = d3.scaleLog(plane.y, [s.bottom, s.top]);
    scales = { x, y };
    const kr = d3.scaleLog(
      plane.y.map((v) => v / plane.perKr),
      [s.bottom, s.top],
    );
    drawGrid(parts.grid, x, y, { x: gridLines(x), y: gridLines(y) });
    parts.bottom.attr("transform", `translate(0,${s.bottom})`);
    parts.left.attr("transform", `translate(${s.left},0)`);
    parts.right.attr("transform", `translate(${s.right},0)`);
    drawAxis(parts.bottom, "bottom", x, labelOf(plane.across).title);
    drawAxis(parts.left, "left", y, "toppling velocity y = k_r g/p [m/s]");
    drawAxis(parts.right, "right", kr, `k_r [g] at p² = ${readable(plane.p2)} 1/s²`);
    drawField(x, y, drawPoint(x, y));
  }

  /** @type {(x: any, y: any, free: (at: number[]) => boolean) => void} */
  function drawField(x, y, free) {
    const areas = grid ? areasAbove(grid, x, y) : [];
    parts.bands
      .selectAll("path")
      .data(areas)
      .join("path")
      .attr("class", (/** @type {any} */ _, /** @type {number} */ i) => `band band-${i}`)
      .attr("d", (/** @type {any} */ d) => d.path);
    parts.lines
      .selectAll("path")
      .data(areas)
      .join("path")
      .attr("class", (/** @type {any} */ d) => (BOLD.includes(d.level) ? "line bold" : "line"))
      .attr("d", (/** @type {any} */ d) => d.path);
    parts.labels
      .selectAll("text")
      .data(labelsOf(areas, x, y, free))
      .join("text")
      .attr("class", "on-line")
      .attr("x", (/** @type {any} */ d) => d.at[0])
      .attr("y", (/** @type {any} */ d) => d.at[1])
      .attr("dy", "0.32em")
      .text((/** @type {any} */ d) => `${readable(100 * d.level)} %`);
    const path = grid ? areaOutside(grid, x, y) : "";
    parts.outside.attr("d", path);
  }

  /** Draw the point; return whether nothing of it is at a place.
   * @type {(x: any, y: any) => (at: number[]) => boolean} */
  function drawPoint(x, y) {
    const { plane, kr, yIsFree, probability } = /** @type {Spot} */ (spot);
    const [px, py] = [x(/** @type {Spot} */ (spot).x), y(kr * plane.perKr)];
    const shown = Number.isFinite(px) && Number.isFinite(py);
    parts.point.attr("display", shown ? null : "none");
    if (!shown) {
      parts.guides.selectAll("line").remove();
      return () => true;
    }
    const [left, bottom] = [x.range()[0], y.range()[0]];
    parts.guides
      .selectAll("line")
      .data([
        [px, py, px, bottom],
        [px, py, left, py],
      ])
      .join("line")
      .attr("class", "guide")
      .attr("x1", (/** @type {number[]} */ d) => d[0])
      .attr("y1", (/** @type {number[]} */ d) => d[1])
      .attr("x2", (/** @type {number[]} */ d) => d[2])
      .attr("y2", (/** @type {number[]} */ d) => d[3]);
    const { name: measure, unit } = labelOf(plane.across);
    const at = /** @type {Spot} */ (spot).x;
    const chance = probability === null ? "" : `, probability ${percent(probability)}`;
    parts.point
      .attr("transform", `translate(${px},${py})`)
      .attr("aria-valuemin", readable(plane.x[0]))
      .attr("aria-valuemax", readable(plane.x[1]))
      .attr("aria-valuenow", at)
      .attr(
        "aria-valuetext",
        `${measure} ${quantity(at, unit)}, toppling velocity ` +
          `${quantity(kr * plane.perKr, "m/s")}, k r ${readable(kr)}${chance}`,
      )
      .attr(
        "aria-roledescription",
        yIsFree ? "point in two directions" : "point along the shaking",
      );
    const side = px + BESIDE + LABEL[0] < x.range()[1] ? 1 : -1;
    parts.point
      .select("text")
      .attr("class", side > 0 ? "beside" : "beside before")
      .attr("x", side * 14)
      .text(probability === null ? "" : percent(probability));
    const labelEnd = [px + side * BESIDE, py];
    return (at) =>
      !touch(at, [px, py]) &&
      !touch(at, labelEnd) &&
      !(at[1] > py && Math.abs(at[0] - px) < LABEL[0] / 2) &&
      !(at[0] < px && Math.abs(at[1] - py) < LABEL[1] / 2);
  }

  return {
    /** @param {Spot} where */
    showPoint(where) {
      spot = where;
      draw();
    },
    /**
     * @param {number} x
     * @param {number | null} kr null where it stays as it is
     */
    movePoint(x, kr) {
      if (spot) spot = { ...spot, x, kr: kr ?? spot.kr, probability: null };
      draw();
    },
    hidePoint() {
      if (spot) spot = { ...spot, x: NaN };
      draw();
    },
    /** @param {import("./contours.js").Grid} answers */
    showGrid(answers) {
      grid = answers;
      draw();
    },
    /** @param {boolean} is whether what is drawn answers the present question */
    upToDate(is) {
      place.classList.toggle("stale", !is);
    },
  };
}

/**
 * While the point is dragged the answer above the chart keeps its height, else the chart would move
 * away under the hand.
 * @param {boolean} is
 */
function keepAnswerInSize(is) {
  const answer = /** @type {HTMLElement} */ (document.querySelector(".answer"));
  answer.style.height = is ? `${answer.offsetHeight}px` : "";
  answer.style.overflow = is ? "hidden" : "";
}

/**
 * @param {number} value
 * @param {[number, number]} range
 */
function within(value, [low, high]) {
  return Math.min(high, Math.max(low, value));
}
