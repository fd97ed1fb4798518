/** Elements of the page by their id. */

import { plain } from "./numbers.js";

/**
 * @param {string} id
 * @returns {HTMLElement}
 */
export function byId(id) {
  return /** @type {HTMLElement} */ (document.getElementById(id));
}

/**
 * The text in a field, as the service reads it.
 * @param {string} id
 * @returns {string}
 */
export function textIn(id) {
  return plain(/** @type {HTMLInputElement} */ (byId(id)).value);
}

/**
 * Warnings as every interface lists them: warnings before notes, each with its label.
 * @param {{severity: string, text: string}[]} diagnostics
 * @returns {string[]}
 */
export function labelled(diagnostics) {
  return [
    ["warning", "Warning"],
    ["note", "Note"],
  ].flatMap(([level, label]) =>
    diagnostics.filter((each) => each.severity === level).map(({ text }) => `${label}: ${text}`),
  );
}
