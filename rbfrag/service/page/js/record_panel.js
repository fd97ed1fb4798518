/** The panel of the reader's record: its spectrum, its doubts, and what it means for the block. */

import { showByRecord, showWarnings } from "./answer.js";
import { Refusal, Unreachable } from "./ask.js";
import { isHalfTyped, nothingWrong, sayWrong } from "./fields.js";
import { afterPause, latest } from "./latest.js";
import { quantity } from "./numbers.js";
import { byId, textIn } from "./page.js";
import { recordsFrom, syntheticPulse, valueAt } from "./record.js";
import { askCritical, askSpectrum } from "./service.js";
import { spectrumPlot } from "./spectrum.js";
import { reached, unreachable } from "./trouble.js";

const PAUSE_MS = 350;
const READING = ["units", "dt", "trace"];

/** Above X(p) by this ratio, no block topples (docs: the toppling spectrum). */
const BOUND = 1.02;

/**
 * @typedef {import("./spectrum.js").Spectrum} Spectrum
 * @typedef {{p2: number, y: number, kr: number}} Place of the block: its p² [1/s²], toppling
 *   velocity [m/s] and strength
 */

/**
 * The panel.
 * @param {{changed: () => void, takePgv: (pgv_m_s: number) => void}} tell whom it tells what
 */
export function recordPanel(tell) {
  const panel = /** @type {HTMLElement} */ (document.querySelector(".record"));
  const plot = spectrumPlot(byId("spectrum"));
  /** @type {File | null} */
  let file = null;
  /** @type {Spectrum | null} */
  let spectrum = null;
  /** @type {Place | null} */
  let block = null;
  /** Whether the shaking of the question is to become that of the record. */
  let isNew = false;

  const ask = latest(async (/** @type {File} */ asked) => {
    byId("record-said").textContent = `Waiting for the spectrum of ${asked.name} …`;
    const reading = readingNow();
    const trace = chosenTrace();
    const name = trace ? `${asked.name}, trace ${trace}` : asked.name;
    try {
      const found = await askSpectrum(asked, reading, block?.p2 ?? NaN, name);
      reached();
      nothingWrong(panel);
      if (asked !== file) return;
      show(found);
      if (isNew) tell.takePgv(found.pgv_m_s);
      isNew = false;
    } catch (error) {
      if (error instanceof Unreachable) return unreachable(error, () => ask(asked));
      if (!(error instanceof Refusal)) throw error;
      nothingWrong(panel);
      if (error.traces && asked === file && !trace) {
        offerTraces(error.traces);
        return ask(asked);
      }
      const words = error.message.replace(/^the file: /, "");
      sayWrong(`${asked.name}: ${words}`, byId("record-error"));
      show(null);
    } finally {
      byId("record-said").textContent = "";
    }
  });
  const askSoon = afterPause(PAUSE_MS, ask);

  /**
   * Offer the traces of a file; none where it has one.
   * @param {string[]} names
   */
  function offerTraces(names) {
    const traces = /** @type {HTMLSelectElement} */ (byId("trace"));
    const text = (/** @type {string} */ name, /** @type {number} */ i) =>
      name ? `${i + 1}: ${name}` : String(i + 1);
    traces.replaceChildren(...names.map((name, i) => new Option(text(name, i), String(i))));
    byId("trace-part").hidden = names.length === 0;
  }

  /** The trace that is chosen, as it is listed; empty where the file has one. */
  function chosenTrace() {
    const traces = /** @type {HTMLSelectElement} */ (byId("trace"));
    return traces.selectedOptions[0]?.text ?? "";
  }

  /** @param {Spectrum | null} found */
  function show(found) {
    spectrum = found;
    byId("spectrum-part").hidden = !found;
    byId("record-part").hidden = !found && byId("trace-part").hidden;
    plot.show(found);
    byId("record-name").textContent = found?.name ?? file?.name ?? "";
    showWarnings(byId("record-warnings"), found?.warnings ?? []);
    compare();
    tell.changed();
  }

  const readingNow = () => Object.fromEntries(READING.map((id) => [id, textIn(id)]));

  function compare() {
    byId("spectrum-words").textContent = spectrum ? inWords(spectrum, block) : "";
    const able = spectrum && block ? canTopple(spectrum, block) : null;
    if (!spectrum || !block || able === null) return showByRecord(null);
    const words = `The block is ${able ? "not " : ""}more than 2 % above its toppling spectrum.`;
    const answer = able ? "Perhaps" : "No, in neither polarity";
    showByRecord({ name: spectrum.name, answer, words: `${words} ${pgvOf(spectrum)}` });
    if (able && file) decide({ file, spectrum, block });
  }

  const decide = latest(async (/** @type {{file: File, spectrum: Spectrum, block: Place}} */ of) => {
    try {
      const { forward, reverse } = await askCritical(of.file, readingNow(), of.block.p2);
      if (of.spectrum !== spectrum || of.block !== block) return;
      const words =
        `It topples blocks of this size up to k_r = ${quantity(forward, "g")} in the forward ` +
        `polarity and ${quantity(reverse, "g")} in the reverse one. ${pgvOf(spectrum)}`;
      const answer = verdict(of.block.kr <= forward, of.block.kr <= reverse);
      showByRecord({ name: spectrum.name, answer, words });
    } catch (error) {
      if (!(error instanceof Refusal || error instanceof Unreachable)) throw error; // still perhaps
    }
  });

  /** @param {File} taken */
  function take(taken) {
    file = taken;
    isNew = true;
    offerTraces([]);
    ask(taken);
    panel.scrollIntoView({ block: "nearest" });
  }

  recordsFrom(byId("drop"), /** @type {HTMLInputElement} */ (byId("record-file")), take);
  byId("example-record").addEventListener("click", () => take(syntheticPulse()));
  for (const id of READING) {
    const input = /** @type {HTMLInputElement} */ (byId(id));
    let half = false;
    input.addEventListener("input", () => {
      isNew = true; // another unit, interval or trace has another PGV
      half = isHalfTyped(input);
      if (file && !half) askSoon(file);
    });
    input.addEventListener("change", () => {
      if (file && half) askSoon(file);
      half = false;
    });
  }
  byId("take-pgv").addEventListener("click", () => spectrum && tell.takePgv(spectrum.pgv_m_s));
  byId("drop-record").addEventListener("click", () => {
    file = null;
    offerTraces([]);
    show(null);
    byId("record-file").focus();
  });

  return {
    show,
    /** The spectrum that is shown, or null. */
    shown: () => spectrum,
    /**
     * Mark the present block.
     * @param {Place | null} place
     * @param {number} [sizeTimesP2] r3 times p² of a rectangle [m/s²]
     */
    placeBlock(place, sizeTimesP2) {
      const other = place && place.p2 !== block?.p2;
      block = place;
      plot.showBlock(place, sizeTimesP2);
      compare();
      if (file && other) askSoon(file);
    },
  };
}

/** Whether a record can topple a block by its spectrum; null where that does not reach.
 * @type {(spectrum: Spectrum, block: Place) => boolean | null} */
function canTopple(spectrum, { p2, y }) {
  const xs = /** @type {const} */ (["forward", "reverse"]).map((each) => valueAt(spectrum, each, p2));
  return xs.every(Number.isFinite) ? xs.some((x) => y <= BOUND * x) : null;
}

/** Whether a record topples a block, with the polarity that does.
 * @type {(forward: boolean, reverse: boolean) => string} */
function verdict(forward, reverse) {
  if (forward && reverse) return "Yes, in both polarities";
  if (forward || reverse) return `Yes, in the ${forward ? "forward" : "reverse"} polarity`;
  return "No, in neither polarity";
}

/** @type {(spectrum: Spectrum) => string} */
function pgvOf(spectrum) {
  return `Its PGV is ${quantity(spectrum.pgv_m_s, "m/s")}.`;
}

/**
 * What a record is, and whether it can topple a block.
 * @param {Spectrum} spectrum
 * @param {Place | null} block
 */
function inWords(spectrum, block) {
  const record = pgvOf(spectrum);
  return block ? `${record} ${comparison(spectrum, block)}` : record;
}

/**
 * Whether a record can topple a block, in words.
 * @param {Spectrum} spectrum
 * @param {Place} block
 */
function comparison(spectrum, { p2, y }) {
  const known = /** @type {const} */ (["forward", "reverse"]).map((polarity) => ({
    polarity,
    x: valueAt(spectrum, polarity, p2),
  }));
  if (known.some(({ x }) => !Number.isFinite(x))) {
    return `The spectrum does not reach p² = ${quantity(p2, "1/s²")}.`;
  }
  const values = known.map(({ polarity, x }) => `${quantity(x, "m/s")} ${polarity}`).join(" and ");
  const able = known.filter(({ x }) => y <= BOUND * x).map(({ polarity }) => polarity);
  const verdict = able.length
    ? `That is not more than 2 % above X(p) in the ${able.join(" and the ")} polarity: so this record ` +
      "may topple the block."
    : "That is more than 2 % above X(p) in both polarities: without vertical motion this record does " +
      "not topple the block.";
  const own = `this block has y = ${quantity(y, "m/s")}`;
  return `At p² = ${quantity(p2, "1/s²")} X(p) is ${values}; ${own}. ${verdict}`;
}
