/** An SVG sheet as wide as its place, drawn again when that changes. */

import { d3 } from "./d3.js";

/**
 * @typedef {{svg: any, plot: any, width: number, height: number, left: number, right: number,
 *   top: number, bottom: number}} Sheet
 */

/**
 * Put an SVG into an element and return a function that gives it its present size.
 *
 * Coordinates are CSS pixels, so that text keeps its size on every screen.
 * @param {HTMLElement} place
 * @param {string} name label for people who do not see it
 * @param {{left: number, right: number, top: number, bottom: number}} margins
 * @param {(width: number) => number} heightOf height of the sheet for a width
 * @param {() => void} redraw called when the width has changed
 * @returns {() => Sheet}
 */
export function sheetIn(place, name, margins, heightOf, redraw) {
  const svg = d3.select(place).append("svg").attr("role", "img").attr("aria-label", name);
  const plot = svg.append("g");
  let width = 0;
  const measure = () => {
    const now = Math.max(Math.floor(place.clientWidth), 240);
    if (now === width) return false;
    width = now;
    return true;
  };
  new ResizeObserver(() => {
    if (measure()) redraw();
  }).observe(place);
  return () => {
    measure();
    const height = Math.round(heightOf(width));
    svg.attr("width", width).attr("height", height).attr("viewBox", `0 0 ${width} ${height}`);
    return {
      svg,
      plot,
      width,
      height,
      left: margins.left,
      right: width - margins.right,
      top: margins.top,
      bottom: height - margins.bottom,
    };
  };
}
