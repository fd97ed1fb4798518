/** The fragility curve of the reader's block, its interval and the range at some sites. */

import { drawAxis, drawGrid, gridLines } from "./axes.js";
import { MARGINS } from "./chart.js";
import { d3 } from "./d3.js";
import { percent } from "./percent.js";
import { labelOf } from "./plane.js";
import { sheetIn } from "./sheet.js";

const SHARES = [0, 0.25, 0.5, 0.75, 1];

/**
 * @typedef {{plane: import("./plane.js").Plane, xs: number[], probability: number[],
 *   ci_low: number[], ci_high: number[], event_low: (number | null)[],
 *   event_high: (number | null)[], in_domain: boolean[]}} Curve
 */

/**
 * Put a fragility curve into an element. Its axis across is that of the chart above it.
 * @param {HTMLElement} place
 */
export function fragilityCurve(place) {
  /** @type {Curve | null} */
  let curve = null;
  /** @type {{x: number, probability: number, ci_low: number, ci_high: number} | null} */
  let spot = null;
  const name =
    "Fragility curve of this block with its interval and, if asked for, the range at some sites";
  const sheet = sheetIn(place, name, MARGINS, () => 230, draw);
  const { svg, plot } = sheet();
  const clip = svg.append("clipPath").attr("id", "curve-clip").append("rect");
  plot.append("rect").attr("class", "area");
  const inside = plot.append("g").attr("clip-path", "url(#curve-clip)");
  const parts = {
    outside: inside.append("g"),
    grid: inside.append("g"),
    event: inside.append("path").attr("class", "one-event"),
    band: inside.append("path").attr("class", "confidence"),
    middle: inside.append("path").attr("class", "curve"),
    bottom: plot.append("g"),
    left: plot.append("g"),
    spot: plot.append("g"),
  };

  function draw() {
    const s = sheet();
    const box = { x: s.left, y: s.top, width: s.right - s.left, height: s.bottom - s.top };
    for (const rect of [clip, plot.select(".area")]) {
      for (const [key, value] of Object.entries(box)) rect.attr(key, value);
    }
    if (!curve) return;
    const { plane, xs } = curve;
    const x = d3.scaleLog(plane.x, [s.left, s.right]);
    const y = d3.scaleLinear([0, 1], [s.bottom, s.top]);
    drawGrid(parts.grid, x, y, { x: gridLines(x), y: SHARES });
    parts.bottom.attr("transform", `translate(0,${s.bottom})`);
    parts.left.attr("transform", `translate(${s.left},0)`);
    drawAxis(parts.bottom, "bottom", x, labelOf(plane.across).title);
    drawAxis(parts.left, "left", y, "probability", { values: SHARES, text: percent });
    const known = (/** @type {number} */ i) => Number.isFinite(curve?.probability[i] ?? NaN);
    const told = (/** @type {number} */ i) => Number.isFinite(curve?.event_low[i] ?? NaN);
    const across = (/** @type {any} */ _, /** @type {number} */ i) => x(xs[i]);
    const all = xs.map((_, i) => i);
    const defined = (/** @type {number} */ i) => known(i);
    /** @type {(where: (i: number) => boolean, low: "ci_low" | "event_low",
     *   high: "ci_high" | "event_high") => string} */
    const between = (where, low, high) =>
      d3
        .area()
        .defined(where)
        .x(across)
        .y0((/** @type {number} */ i) => y(curve?.[low][i]))
        .y1((/** @type {number} */ i) => y(curve?.[high][i]))(all);
    parts.event.attr("d", between(told, "event_low", "event_high"));
    parts.band.attr("d", between(defined, "ci_low", "ci_high"));
    parts.middle.attr(
      "d",
      d3
        .line()
        .defined(defined)
        .x(across)
        .y((/** @type {number} */ i) => y(curve?.probability[i]))(all),
    );
    parts.outside
      .selectAll("rect")
      .data(runsOutside(curve.in_domain))
      .join("rect")
      .attr("class", "outside")
      .attr("x", (/** @type {number[]} */ [a]) => x(xs[a]))
      .attr("width", (/** @type {number[]} */ [a, b]) => x(xs[b]) - x(xs[a]))
      .attr("y", s.top)
      .attr("height", s.bottom - s.top);
    drawSpot(x, y);
  }

  /** @type {(x: any, y: any) => void} */
  function drawSpot(x, y) {
    const shown = spot && spot.x > 0 ? [spot] : [];
    const group = parts.spot.selectAll("g").data(shown).join("g");
    group.selectAll("*").remove();
    group
      .append("line")
      .attr("class", "whisker")
      .attr("x1", (/** @type {any} */ d) => x(d.x))
      .attr("x2", (/** @type {any} */ d) => x(d.x))
      .attr("y1", (/** @type {any} */ d) => y(d.ci_low))
      .attr("y2", (/** @type {any} */ d) => y(d.ci_high));
    group
      .append("circle")
      .attr("class", "dot")
      .attr("r", 5)
      .attr("cx", (/** @type {any} */ d) => x(d.x))
      .attr("cy", (/** @type {any} */ d) => y(d.probability));
    // the curve rises: below it on its right, and above it on its left, there is room
    const [left, right] = x.range();
    const before = (/** @type {any} */ d) => x(d.x) > left + 0.8 * (right - left);
    const low = (/** @type {any} */ d) => d.probability < 0.15;
    group
      .append("text")
      .attr("class", (/** @type {any} */ d) => (before(d) ? "beside before" : "beside"))
      .attr("x", (/** @type {any} */ d) => x(d.x) + (before(d) ? -10 : 10))
      .attr("y", (/** @type {any} */ d) => y(d.probability) + (before(d) || low(d) ? -9 : 14))
      .text((/** @type {any} */ d) => percent(d.probability));
  }

  return {
    /** @param {Curve} answers */
    showCurve(answers) {
      curve = answers;
      draw();
    },
    /** @param {{x: number, probability: number, ci_low: number, ci_high: number} | null} where */
    showSpot(where) {
      spot = where;
      draw();
    },
    /** @param {boolean} is whether what is drawn answers the present question */
    upToDate(is) {
      place.classList.toggle("stale", !is);
    },
  };
}

/**
 * First and last index of each run of answers out of the fitted range.
 * @param {boolean[]} inDomain
 * @returns {number[][]}
 */
function runsOutside(inDomain) {
  /** @type {number[][]} */
  const runs = [];
  inDomain.forEach((inside, i) => {
    if (inside) return;
    const last = runs.at(-1);
    if (last && last[1] === i - 1) last[1] = i;
    else runs.push([i, i]);
  });
  return runs;
}
