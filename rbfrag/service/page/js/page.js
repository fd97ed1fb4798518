/** Elements of the page by their id. */

/**
 * @param {string} id
 * @returns {HTMLElement}
 */
export function byId(id) {
  return /** @type {HTMLElement} */ (document.getElementById(id));
}

/**
 * The text in a field, trimmed.
 * @param {string} id
 * @returns {string}
 */
export function textIn(id) {
  return /** @type {HTMLInputElement} */ (byId(id)).value.trim();
}
