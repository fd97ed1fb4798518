/** Logarithmic axes with plain numbers, alike in all figures of the page. */

import { d3 } from "./d3.js";
import { readable } from "./numbers.js";
import { writeSvgText } from "./subscripts.js";

/** Numbers of a decade that may be written, the most first. */
const DIGITS = [[1, 2, 3, 5, 7], [1, 2, 5], [1, 3], [1]];

/** Room that a number takes along an axis, in pixels. */
const ROOM = { across: 38, up: 18 };

/**
 * The numbers that are written on a logarithmic axis.
 * @param {any} scale
 * @param {number} room that a number takes along the axis, in pixels
 * @returns {number[]}
 */
function marks(scale, room) {
  const [low, high] = scale.domain();
  const [a, b] = scale.range();
  const decade = Math.abs(b - a) / Math.abs(Math.log10(high / low));
  const fits = (/** @type {number[]} */ digits) =>
    digits.every((digit, i) => decade * Math.log10((digits[i + 1] ?? 10) / digit) >= room);
  const digits = DIGITS.find(fits) ?? [1];
  return withinDecades(Math.min(low, high), Math.max(low, high), digits);
}

/**
 * The lines of a logarithmic grid.
 * @param {any} scale
 * @returns {number[]}
 */
export function gridLines(scale) {
  const [low, high] = scale.domain();
  return withinDecades(Math.min(low, high), Math.max(low, high), [1, 2, 3, 4, 5, 6, 7, 8, 9]);
}

/**
 * Draw an axis with its numbers and its title.
 * @param {any} group SVG group at the axis
 * @param {"bottom" | "top" | "left" | "right"} side
 * @param {any} scale
 * @param {string} title
 * @param {{values?: number[], text?: (value: number) => string}} [how]
 */
export function drawAxis(group, side, scale, title, how = {}) {
  const axis = { bottom: d3.axisBottom, top: d3.axisTop, left: d3.axisLeft, right: d3.axisRight };
  const room = side === "left" || side === "right" ? ROOM.up : ROOM.across;
  const values = how.values ?? marks(scale, room);
  const text = how.text ?? ((/** @type {number} */ value) => readable(value));
  group
    .attr("class", "axis")
    .call(axis[side](scale).tickValues(values).tickFormat(text).tickSize(5).tickSizeOuter(0));
  group.selectAll(".title").data([title]).join("text").attr("class", "title");
  const [a, b] = scale.range();
  const middle = (a + b) / 2;
  const label = group.select(".title");
  writeSvgText(label, title);
  if (side === "bottom") label.attr("x", middle).attr("y", 34);
  if (side === "top") label.attr("x", middle).attr("y", -24);
  if (side === "left") label.attr("transform", `translate(-48,${middle}) rotate(-90)`);
  if (side === "right") label.attr("transform", `translate(44,${middle}) rotate(90)`);
}

/**
 * Draw grid lines across a plot.
 * @param {any} group
 * @param {any} x
 * @param {any} y
 * @param {{x: number[], y: number[]}} at
 */
export function drawGrid(group, x, y, at) {
  const [left, right] = x.range();
  const [bottom, top] = y.range();
  const lines = [
    ...at.x.map((v) => [x(v), bottom, x(v), top]),
    ...at.y.map((v) => [left, y(v), right, y(v)]),
  ];
  group
    .attr("class", "grid")
    .selectAll("line")
    .data(lines)
    .join("line")
    .attr("x1", (/** @type {number[]} */ d) => d[0])
    .attr("y1", (/** @type {number[]} */ d) => d[1])
    .attr("x2", (/** @type {number[]} */ d) => d[2])
    .attr("y2", (/** @type {number[]} */ d) => d[3]);
}

/**
 * @param {number} low
 * @param {number} high
 * @param {number[]} digits
 */
function withinDecades(low, high, digits) {
  const found = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += 1) {
    for (const digit of digits) {
      const value = Number(`${digit}e${power}`);
      if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) found.push(value);
    }
  }
  return found;
}
