/** The tools above the page: copy the link, print. */

import { afterPause } from "./latest.js";
import { byId } from "./page.js";

const SHOWN_MS = 4000;
const MESSAGES = ["link-copied", "link-kept"];

/** @param {() => URL} address of what is shown */
export function tools(address) {
  const button = byId("copy-link");
  const showOnly = (/** @type {string} */ shown) => {
    for (const id of MESSAGES) byId(id).hidden = id !== shown;
  };
  const back = afterPause(SHOWN_MS, () => showOnly(""));
  button.addEventListener("click", async () => {
    const shown = address();
    history.replaceState(null, "", shown);
    showOnly((await copied(shown.href)) ? "link-copied" : "link-kept");
    back();
  });
  byId("print").addEventListener("click", () => print());
  addEventListener("beforeprint", () => {
    const link = /** @type {HTMLAnchorElement} */ (byId("paper-link"));
    link.href = link.textContent = address().href;
  });
}

/** @param {string} text */
async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
