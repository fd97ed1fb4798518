/** The tools above the page: copy the link, print. */

import { byId } from "./page.js";

/**
 * @param {() => URL} address of what is shown
 * @param {() => URL} shortAddress the same without a record's spectrum, to be typed from paper
 */
export function tools(address, shortAddress) {
  byId("copy-link").addEventListener("click", async () => {
    const shown = address();
    history.replaceState(null, "", shown);
    const said = byId("link-said");
    try {
      await navigator.clipboard.writeText(shown.href);
      said.textContent = "The link is copied. It holds all that is shown.";
    } catch {
      said.textContent = "The browser does not let the page copy: the address line holds the link.";
    }
  });
  byId("print").addEventListener("click", () => print());
  addEventListener("beforeprint", () => {
    byId("paper-link").textContent = shortAddress().href;
  });
}
