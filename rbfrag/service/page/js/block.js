/** The block drawn to scale on its planes, with its mode named. */

import { d3 } from "./d3.js";
import { quantity, readable } from "./numbers.js";
import { byId } from "./page.js";
import { sheetIn } from "./sheet.js";
import { writeText } from "./subscripts.js";

const NAME = "The block on its planes";
const MARGINS = { left: 8, right: 8, top: 14, bottom: 30 };

/**
 * How a block fails, in the words of `rbfrag block`.
 * @param {any} block of an answer of /v1/drawing
 */
function inWords(block) {
  return block.text.sentences[0];
}

/**
 * Put the drawing of a block into an element.
 * @param {HTMLElement} place
 */
export function blockDrawing(place) {
  /** @type {any} */
  let lines = null;
  const sheet = sheetIn(
    place,
    NAME,
    MARGINS,
    (w) => Math.min(0.95 * w, 300),
    draw,
  );
  const { svg, plot } = sheet();
  const head = svg.append("marker").attr("id", "arrow").attr("viewBox", "0 0 8 8");
  head.attr("refX", 7).attr("refY", 4).attr("markerWidth", 7).attr("markerHeight", 7);
  head.attr("orient", "auto").append("path").attr("class", "head").attr("d", "M0,0L8,4L0,8Z");

  function draw() {
    const s = sheet();
    plot.selectAll("*").remove();
    if (!lines) return;
    const all = [...lines.outline_m, ...lines.rock_m, lines.resultant_m];
    const [left, right] = d3.extent(all, (/** @type {number[]} */ p) => p[0]);
    const [low, high] = d3.extent(all, (/** @type {number[]} */ p) => p[1]);
    const scale = Math.min((s.right - s.left) / (right - left), (s.bottom - s.top) / (high - low));
    const midX = (s.left + s.right) / 2;
    const midY = (s.top + s.bottom) / 2;
    const at = (/** @type {number[]} */ [px, py]) => [
      midX + scale * (px - (left + right) / 2),
      midY - scale * (py - (low + high) / 2),
    ];
    const path = (/** @type {number[][]} */ points) => `M${points.map((p) => at(p)).join("L")}`;
    plot
      .append("path")
      .attr("class", "rock")
      .attr("d", `${path(lines.rock_m)}Z`);
    plot.append("path").attr("class", "planes").attr("d", path(lines.planes_m));
    plot
      .append("path")
      .attr("class", `outline ${lines.block.mode}`)
      .attr("d", `${path(lines.outline_m)}Z`);
    for (const [number, contact] of Object.entries(lines.contacts_m)) {
      const [cx, cy] = at(/** @type {number[]} */ (contact));
      const [ox, oy] = at([0, 0]);
      const away = Math.hypot(cx - ox, cy - oy) || 1;
      plot.append("circle").attr("class", "contact").attr("cx", cx).attr("cy", cy).attr("r", 4);
      plot
        .append("text")
        .attr("class", "contact-name")
        .attr("x", cx + (15 * (cx - ox)) / away)
        .attr("y", cy + (15 * (cy - oy)) / away)
        .attr("dy", "0.34em")
        .text(number);
    }
    const [ox, oy] = at([0, 0]);
    const [tx, ty] = at(lines.resultant_m);
    plot
      .append("line")
      .attr("class", "resultant")
      .attr("marker-end", "url(#arrow)")
      .attr("x1", ox)
      .attr("y1", oy)
      .attr("x2", tx)
      .attr("y2", ty);
    plot.append("circle").attr("class", "centroid").attr("cx", ox).attr("cy", oy).attr("r", 3.5);
    drawLength(plot, s, scale, 0.4 * (right - left));
  }

  return {
    /**
     * @param {any} drawing answer of /v1/drawing
     * @param {import("./question.js").Question} question
     */
    show(drawing, { shape }) {
      lines = drawing;
      draw();
      const isUnknown = shape === "numbers";
      byId("rectangle-words").hidden = !isUnknown;
      byId("rectangle-r3").textContent = quantity(drawing.block.r3_m, "m");
      writeText(byId("block-words"), isUnknown ? "" : inWords(drawing.block));
      svg.attr("aria-label", `${NAME}. ${byId("block-words").textContent}`);
      this.upToDate(true);
    },
    /** @param {boolean} is whether what is drawn is the present block */
    upToDate(is) {
      place.classList.toggle("stale", !is);
    },
  };
}

/**
 * Draw a length of a round number of metres.
 * @param {any} plot
 * @param {import("./sheet.js").Sheet} s
 * @param {number} scale pixels a metre
 * @param {number} wanted about how long it may be [m]
 */
function drawLength(plot, s, scale, wanted) {
  const power = 10 ** Math.floor(Math.log10(wanted));
  const length = ([5, 2, 1].find((d) => d * power <= wanted) ?? 1) * power;
  const y = s.height - 16;
  const group = plot.append("g").attr("class", "length");
  group.append("path").attr("d", `M${s.left},${y - 3}v6m0,-3h${length * scale}m0,-3v6`);
  group
    .append("text")
    .attr("x", s.left)
    .attr("y", y + 14)
    .text(`${readable(length)}\u00a0m`);
}
