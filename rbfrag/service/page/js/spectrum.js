/** The toppling spectrum of a record over the size of blocks, with the reader's block. */

import { drawAxis, drawGrid, gridLines } from "./axes.js";
import { d3 } from "./d3.js";
import { readable } from "./numbers.js";
import { sheetIn } from "./sheet.js";
import { titleOf } from "./vocabulary.js";

const MARGINS = { left: 62, right: 18, top: 46, bottom: 64 };
const LOWEST_SHARE = 0.02;

/**
 * @typedef {import("./answer.js").Texts} Texts
 * @typedef {{name: string, pgv_m_s: number, p2: number[], forward: number[], reverse: number[],
 *   warnings: string[], texts: Texts, verdict: {p2: number, kr: number, texts: Texts} | null}}
 *   Spectrum with what the service says of it, and of a block under it
 */

/**
 * Put a spectrum into an element.
 * @param {HTMLElement} place
 */
export function spectrumPlot(place) {
  /** @type {Spectrum | null} */
  let found = null;
  /** @type {{p2: number, y: number} | null} */
  let block = null;
  /** Distance from centroid to toe of a rectangular block, times its p² [m/s²]. */
  let sizeTimesP2 = NaN;
  const sheet = sheetIn(
    place,
    "Toppling spectrum of the record",
    MARGINS,
    (w) => Math.min(Math.max(0.6 * w, 300), 430),
    draw,
  );
  const { svg, plot } = sheet();
  const clip = svg.append("clipPath").attr("id", "spectrum-clip").append("rect");
  plot.append("rect").attr("class", "area");
  const inside = plot.append("g").attr("clip-path", "url(#spectrum-clip)");
  const grid = inside.append("g");
  const curves = inside.append("g");
  const [bottom, top, left] = [plot.append("g"), plot.append("g"), plot.append("g")];
  const spot = plot.append("g");
  const key = plot.append("g").attr("class", "key");

  function draw() {
    const s = sheet();
    const box = { x: s.left, y: s.top, width: s.right - s.left, height: s.bottom - s.top };
    for (const rect of [clip, plot.select(".area")]) {
      for (const [name, value] of Object.entries(box)) rect.attr(name, value);
    }
    if (!found) return;
    const x = d3.scaleLog(d3.extent(found.p2), [s.left, s.right]);
    const y = d3.scaleLog(rangeOf(found, block?.y), [s.bottom, s.top]);
    drawGrid(grid, x, y, { x: gridLines(x), y: gridLines(y) });
    bottom.attr("transform", `translate(0,${s.bottom})`);
    left.attr("transform", `translate(${s.left},0)`);
    top.attr("transform", `translate(0,${s.top})`);
    drawAxis(bottom, "bottom", x, titleOf("p2"));
    drawAxis(left, "left", y, "X(p), PGV and block’s y [m/s]");
    const sizes = x.copy().domain(x.domain().map((/** @type {number} */ p2) => sizeTimesP2 / p2));
    top.attr("display", Number.isFinite(sizeTimesP2) ? null : "none");
    if (Number.isFinite(sizeTimesP2)) {
      drawAxis(top, "top", sizes, titleOf("r3"));
    }
    const line = (/** @type {number[]} */ values) =>
      d3
        .line()
        .defined((/** @type {number} */ i) => values[i] > 0)
        .x((/** @type {number} */ i) => x(found?.p2[i]))
        .y((/** @type {number} */ i) => y(values[i]))(values.map((_, i) => i));
    const level = found.pgv_m_s > 0 ? `M${s.left},${y(found.pgv_m_s)}H${s.right}` : "";
    curves
      .selectAll("path")
      .data([
        ["forward", line(found.forward)],
        ["reverse", line(found.reverse)],
        ["pgv", level],
      ])
      .join("path")
      .attr("class", (/** @type {string[]} */ [kind]) => `spectrum ${kind}`)
      .attr("d", (/** @type {string[]} */ [, path]) => path);
    drawBlock(x, y);
    drawKey(s);
  }

  /** @type {(x: any, y: any) => void} */
  function drawBlock(x, y) {
    spot.selectAll("*").remove();
    if (!block || !(block.y > 0)) return;
    const [px, py] = [x(block.p2), y(block.y)];
    const right = px < (x.range()[0] + x.range()[1]) / 2;
    spot
      .append("text")
      .attr("class", right ? "beside" : "beside before")
      .attr("x", px + (right ? 11 : -11))
      .attr("y", py)
      .attr("dy", "0.32em")
      .text("this block");
    spot.append("circle").attr("class", "dot").attr("r", 6).attr("cx", px).attr("cy", py);
  }

  /** @param {import("./sheet.js").Sheet} s */
  function drawKey(s) {
    const items = [
      ["forward", "X, forward"],
      ["reverse", "X, reverse"],
      ["pgv", "PGV"],
    ];
    const step = Math.min((s.width - 24) / items.length, 150);
    const from = Math.min(s.left, s.width - 12 - step * items.length);
    const rows = key.selectAll("g").data(items).join("g");
    rows.attr(
      "transform",
      (/** @type {any} */ _, /** @type {number} */ i) =>
        `translate(${from + i * step},${s.height - 10})`,
    );
    rows.selectAll("*").remove();
    rows
      .append("path")
      .attr("class", (/** @type {string[]} */ [kind]) => `spectrum ${kind}`)
      .attr("d", "M0,-4h22");
    rows
      .append("text")
      .attr("x", 28)
      .text((/** @type {string[]} */ [, text]) => text);
  }

  return {
    /** @param {Spectrum | null} spectrum */
    show(spectrum) {
      found = spectrum;
      draw();
      if (spectrum) {
        svg.attr(
          "aria-label",
          `Toppling spectrum of ${spectrum.name}, p² from ${readable(spectrum.p2[0])} to ` +
            `${readable(spectrum.p2[spectrum.p2.length - 1])} per second squared`,
        );
      }
    },
    /**
     * @param {{p2: number, y: number} | null} where
     * @param {number} [sizeFactor] r3 times p² of a rectangular block [m/s²]
     */
    showBlock(where, sizeFactor) {
      block = where;
      if (sizeFactor) sizeTimesP2 = sizeFactor;
      draw();
    },
  };
}

/**
 * @param {Spectrum} spectrum
 * @param {number | undefined} y of the block
 * @returns {[number, number]}
 */
function rangeOf(spectrum, y) {
  const values = [...spectrum.forward, ...spectrum.reverse, spectrum.pgv_m_s].filter((v) => v > 0);
  const highest = Math.max(...values);
  const lowest = Math.max(Math.min(...values), LOWEST_SHARE * highest);
  const own = y !== undefined && y > 0 ? [y] : [];
  return [0.7 * Math.min(lowest, ...own), 1.4 * Math.max(highest, ...own)];
}
