/** A table of blocks, pasted or dropped: asked row by row, given back with answers. */

import { post, Refusal, Unreachable } from "./ask.js";
import { inLabels } from "./fields.js";
import { fromField } from "./numbers.js";
import { byId } from "./page.js";
import { BLOCK_FIELDS, MEASURES, only } from "./question.js";

const ANSWERS = ["probability", "ci_low", "ci_high", "in_domain", "reason"];
const OF_BLOCKS = [...Object.values(BLOCK_FIELDS).flat(), "restitution"];
const UNIT = /(?:_(?:m_s|m|deg|g|s|1_s2)|\s*[[(](?:m\/s|m|deg|°|g|s|1\/s2|1\/s²)[\])])$/;
const FIELDS = [...OF_BLOCKS, ...MEASURES];

/** @param {() => import("./question.js").Question} present what is asked above the table */
export function blockTable(present) {
  const text = /** @type {HTMLTextAreaElement} */ (byId("table-text"));
  const file = /** @type {HTMLAnchorElement} */ (byId("table-file"));
  text.addEventListener("drop", async (event) => {
    const [dropped] = event.dataTransfer?.files ?? [];
    if (!dropped) return; // but text
    event.preventDefault();
    event.stopPropagation(); // it is no record
    text.value = await dropped.text();
    answer();
  });
  byId("table-ask").addEventListener("click", answer);

  async function answer() {
    byId("table-error").textContent = byId("table-said").textContent = "";
    file.hidden = true;
    try {
      const rows = cellsOf(text.value);
      const found = await post("v1/predict", questionOf(rows, present().values));
      const answers = (/** @type {number} */ i) => ANSWERS.map((name) => found[name][i - 1] ?? "");
      const lines = rows.map((cells, i) => [...cells, ...(i ? answers(i) : ANSWERS)].map(quoted));
      URL.revokeObjectURL(file.href);
      file.href = URL.createObjectURL(new Blob(["\ufeff", ...lines.map((line) => `${line}\r\n`)]));
      file.hidden = false;
      const known = found.probability.filter(Number.isFinite).length;
      byId("table-said").textContent = `${known} of ${rows.length - 1} blocks are answered.`;
    } catch (error) {
      const said = [Refusal, Unreachable, RangeError].some((kind) => error instanceof kind);
      if (!said) throw error;
      const words = /** @type {Error} */ (error).message; // our own name the table's columns
      byId("table-error").textContent = error instanceof RangeError ? words : inLabels(words);
    }
  }
}

function cellsOf(/** @type {string} */ text) {
  const lines = text.replace("\ufeff", "").split(/\r?\n/).filter((line) => line.trim());
  if (lines.length < 2) throw new RangeError("Paste names of columns, and a row for each block.");
  const mark = ["\t", ";"].find((each) => lines[0].includes(each)) ?? ",";
  return lines.map((line) => line.split(mark).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1")));
}

/** @type {(rows: string[][], values: Record<string, string>) => object} */
function questionOf([names, ...rows], values) {
  /** @type {Record<string, any>} */
  const columns = {};
  for (const [i, name] of names.entries()) {
    const bare = name.toLowerCase();
    const field = FIELDS.find((each) => each === bare || each === bare.replace(UNIT, ""));
    if (field) columns[field] = rows.map((cells, row) => {
      const value = cells[i] ? fromField(cells[i]) : null;
      if (Number.isNaN(value)) throw new RangeError(`Row ${row + 2}: ${name} is no number: ${cells[i]}`);
      return value;
    });
  }
  if (!OF_BLOCKS.some((name) => columns[name])) {
    throw new RangeError("No column names a block: height_m and width_m, or p2 and kr.");
  }
  const shaking = only(values, MEASURES.some((name) => columns[name]) ? [] : MEASURES);
  for (const name in shaking) columns[name] = fromField(shaking[name]);
  return { ...only(values, ["kind", "model"]), ...columns };
}

function quoted(/** @type {unknown} */ cell) {
  const text = String(cell).replace(/^[=@]/, "'$&"); // no formula for spreadsheets
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}
