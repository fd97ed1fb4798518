/** The address of the page holds all that is shown: the question, and a record's spectrum. */

import { afterPause } from "./latest.js";
import { fromQuery, toQuery } from "./question.js";
import { fromFragment, toFragment } from "./record.js";

const PAUSE_MS = 250;

/** The question and the spectrum in the present address. */
export function fromAddress() {
  return {
    question: fromQuery(new URLSearchParams(location.search)),
    spectrum: fromFragment(location.hash.slice(1)),
  };
}

/**
 * The address that shows the same.
 * @param {import("./question.js").Question} question
 * @param {import("./spectrum.js").Spectrum | null} spectrum
 * @returns {URL}
 */
export function addressOf(question, spectrum) {
  const address = new URL(location.href);
  address.search = toQuery(question);
  address.hash = toFragment(spectrum);
  return address;
}

/** Put an address into the browser's line, after a pause: browsers limit how often. */
export const showAddress = afterPause(PAUSE_MS, (/** @type {URL} */ address) => {
  history.replaceState(null, "", address);
});
