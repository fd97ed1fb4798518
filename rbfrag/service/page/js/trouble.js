/** A service that does not answer, or asks for its token. */

import { useToken } from "./ask.js";
import { byId, textIn } from "./page.js";

const RETRY_MS = 4000;

/**
 * Say that there is no answer now, and try again.
 * @param {import("./ask.js").Unreachable} error
 * @param {() => void} retry
 */
export function unreachable(error, retry) {
  byId("unreachable-reason").textContent = error.message;
  byId("unreachable").hidden = false;
  setTimeout(retry, RETRY_MS);
}

/** The service has answered. */
export function reached() {
  byId("unreachable").hidden = true;
  byId("token-form").hidden = true;
}

/** Ask the reader for the token. */
export function tokenMissing() {
  byId("unreachable").hidden = true;
  byId("token-form").hidden = false;
}

/**
 * Ask again when the reader has given the token.
 * @param {() => void} again
 */
export function whenTokenGiven(again) {
  byId("token-form").addEventListener("submit", (event) => {
    event.preventDefault();
    useToken(textIn("token"));
    again();
  });
}
