/** A table of blocks, pasted or dropped: answered by the service, given back with answers. */

import { Refusal, Unreachable, upload } from "./ask.js";
import { showWarnings } from "./answer.js";
import { plain } from "./numbers.js";
import { byId, labelled } from "./page.js";
import { MEASURES, only } from "./question.js";

/** @param {() => import("./question.js").Question} present what is asked above the table */
export function blockTable(present) {
  const text = /** @type {HTMLTextAreaElement} */ (byId("table-text"));
  const file = /** @type {HTMLAnchorElement} */ (byId("table-file"));
  text.addEventListener("drop", async (event) => {
    const [dropped] = event.dataTransfer?.files ?? [];
    if (!dropped) return; // but text
    event.preventDefault();
    event.stopPropagation(); // it is not a record
    const isWorkbook = dropped.name.toLowerCase().endsWith(".xlsx");
    text.value = isWorkbook ? "" : await dropped.text();
    answer(dropped, isWorkbook ? "xlsx" : "csv");
  });
  byId("table-ask").addEventListener("click", () => answer(new Blob([text.value]), "csv"));

  /** @type {(table: Blob, form: string) => Promise<void>} */
  async function answer(table, form) {
    byId("table-error").textContent = byId("table-said").textContent = "";
    showWarnings(byId("table-notes"), []);
    file.hidden = true;
    const { values } = present();
    const measures = Object.entries(only(values, MEASURES)).map(([n, v]) => [n, plain(v)]);
    const query = { ...only(values, ["kind", "model"]), ...Object.fromEntries(measures), form, text: "true" };
    try {
      const found = await upload("v1/table", query, table);
      URL.revokeObjectURL(file.href);
      file.href = URL.createObjectURL(new Blob(["\ufeff", found.table]));
      file.hidden = false;
      byId("table-said").textContent = found.text.sentences[0];
      showWarnings(byId("table-notes"), labelled(found.diagnostics));
    } catch (error) {
      if (![Refusal, Unreachable].some((kind) => error instanceof kind)) throw error;
      byId("table-error").textContent = /** @type {Error} */ (error).message;
    }
  }
}
