/** The panel of the reader's record: its spectrum, its warnings, and the answer for the block. */

import { showByRecord, showTexts, showWarnings, spoken } from "./answer.js";
import { Refusal, Unreachable } from "./ask.js";
import { isHalfTyped, nothingWrong, sayWrong } from "./fields.js";
import { afterPause, latest } from "./latest.js";
import { byId, textIn } from "./page.js";
import { recordsFrom, syntheticPulse } from "./record.js";
import { askBounds, askCritical, askSpectrum } from "./service.js";
import { spectrumPlot } from "./spectrum.js";
import { reached, unreachable } from "./trouble.js";

const PAUSE_MS = 350;
const READING = ["units", "dt", "trace"];

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
    byId("record-said").hidden = false;
    const reading = readingNow();
    const trace = chosenTrace();
    const name = trace ? `${asked.name}, trace ${trace}` : asked.name;
    try {
      const found = await askSpectrum(asked, reading, name);
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
      byId("record-said").hidden = true;
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

  /** Show what the service says of the present block; ask where it has not said it yet. */
  function compare() {
    const { verdict = null, name = "", texts = [] } = spectrum ?? {};
    const isOfBlock = verdict && verdict.p2 === block?.p2 && verdict.kr === block.kr;
    showTexts(byId("spectrum-words"), texts);
    showByRecord(name, isOfBlock ? verdict.texts : []);
    if (file && spectrum && block && !isOfBlock) decide({ file, spectrum, block });
  }

  const decide = latest(async (/** @type {{file: File, spectrum: Spectrum, block: Place}} */ of) => {
    const { p2, kr } = of.block;
    const asked = { ...readingNow(), p2, kr };
    /** @type {(answers: any[]) => void} */
    const showVerdict = (answers) => {
      // the same block may have been placed again meanwhile, with other shaking
      if (of.spectrum !== spectrum || block?.p2 !== p2 || block.kr !== kr) return;
      spectrum.verdict = { p2, kr, texts: answers.map(spoken) };
      compare();
      tell.changed();
    };
    try {
      const bounds = await askBounds(of.file, asked, of.spectrum.name);
      showVerdict(bounds);
      // the certified search takes longer: only where the spectrum leaves it open
      if (!bounds.some(({ may_topple }) => may_topple)) return;
      showVerdict(await askCritical(of.file, asked, of.spectrum.name));
    } catch (error) {
      if (!(error instanceof Refusal || error instanceof Unreachable)) throw error; // bounds stay
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
      block = place;
      plot.showBlock(place, sizeTimesP2);
      compare();
    },
  };
}
