/** Symbols with an index: "k_r" is written as k with a small, lowered r. */

import { d3 } from "./d3.js";

/** Splits after a symbol that has an index; names such as pga_tm are left whole. */
const PARTS = /(?<=(?<!\w)[kprTI])_(\w|ct)(?!\w)/;

/**
 * Write text into an element of the page, indices as `<sub>`.
 * @param {HTMLElement} element
 * @param {string} text
 */
export function writeText(element, text) {
  element.replaceChildren(
    ...text.split(PARTS).map((part, i) => {
      if (i % 2 === 0) return part;
      const sub = document.createElement("sub");
      sub.textContent = part;
      return sub;
    }),
  );
}

/**
 * Write text into an SVG text element, indices lowered.
 * @param {any} selection of one element
 * @param {string} text
 */
export function writeSvgText(selection, text) {
  const parts = text
    .split(PARTS)
    .map((part, i) => ({ part, low: i % 2 === 1, after: i > 0 && i % 2 === 0 }));
  selection
    .selectAll("tspan")
    .data(parts)
    .join("tspan")
    .attr("dy", (/** @type {any} */ d) => (d.low ? "0.28em" : d.after ? "-0.21em" : null))
    .attr("class", (/** @type {any} */ d) => (d.low ? "index" : null))
    .each(function (/** @type {any} */ d) {
      // @ts-ignore: `this` is the element, by D3's convention
      d3.select(this).text(d.part);
    });
}
