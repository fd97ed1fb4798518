/** The tools above the page: copy the link, print. */

import { afterPause } from "./latest.js";
import { byId } from "./page.js";

const SHOWN_MS = 4000;

/** @param {() => URL} address of what is shown */
export function tools(address) {
  const button = byId("copy-link");
  const words = button.textContent;
  const back = afterPause(SHOWN_MS, () => {
    button.textContent = words;
    byId("link-said").textContent = "";
  });
  button.addEventListener("click", async () => {
    const shown = address();
    history.replaceState(null, "", shown);
    if (await copied(shown.href)) {
      button.textContent = "Copied";
      byId("link-said").textContent = "The link is copied. It holds all that is shown.";
    } else {
      byId("link-said").textContent =
        "The browser does not let the page copy: the address line holds the link.";
    }
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
