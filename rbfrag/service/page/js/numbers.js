/** Numbers as people read them and as fields hold them. */

/** Significant digits of a value that the point or an arrow key sets. */
const FIELD_DIGITS = 3;

/** No-break space between a number and its unit. */
const GAP = "\u00a0";

/**
 * A number with so many significant digits, without an exponent where it can be read without.
 * @param {number} value
 * @param {number} [digits]
 * @returns {string}
 */
export function readable(value, digits = 3) {
  if (!Number.isFinite(value)) return "none";
  const size = Math.abs(value);
  if (value !== 0 && (size < 1e-4 || size >= 1e7)) return value.toExponential(digits - 1);
  return withMinus(String(Number(value.toPrecision(digits))));
}

/**
 * A number and its unit, which do not part at the end of a line.
 * @param {number} value
 * @param {string} unit
 * @param {number} [digits]
 * @returns {string}
 */
export function quantity(value, unit, digits = 3) {
  return unit ? `${readable(value, digits)}${GAP}${unit}` : readable(value, digits);
}

/**
 * A value as a field takes it: plain digits, few of them.
 * @param {number} value
 * @returns {string}
 */
export function forField(value) {
  return String(Number(value.toPrecision(FIELD_DIGITS)));
}

const DECIMAL_COMMA = /^[+-]?(\d+,\d*|,\d+)(e[+-]?\d+)?$/i;

/** 1,000 is a thousand to one reader and 1 to another. */
const EITHER_COMMA = /^[+-]?[1-9]\d{0,2},\d{3}(e|$)/i;

/**
 * A text as the service reads it: a decimal comma is a point, a typographic minus a hyphen. A comma
 * that may as well part thousands is left, and the service refuses it.
 * @param {string} text
 * @returns {string}
 */
export function plain(text) {
  const number = text.trim().replace(/^\u2212/, "-");
  const decimal = DECIMAL_COMMA.test(number) && !EITHER_COMMA.test(number);
  return decimal ? number.replace(",", ".") : number;
}

/**
 * The number a field's text states, or NaN.
 * @param {string} text
 * @returns {number}
 */
export function fromField(text) {
  return text.trim() === "" ? NaN : Number(plain(text));
}

/**
 * So many numbers from low to high, at equal ratios.
 * @param {number} low above 0
 * @param {number} high
 * @param {number} count
 * @returns {number[]}
 */
export function ratios(low, high, count) {
  const step = Math.log(high / low) / (count - 1);
  return Array.from({ length: count }, (_, i) => low * Math.exp(step * i));
}

/** @param {string} text */
function withMinus(text) {
  return text.replace("-", "\u2212");
}
