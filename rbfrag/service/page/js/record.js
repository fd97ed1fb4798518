/** The reader's record: dropped on the page or chosen, asked for its spectrum, kept in a link. */

import { spoken } from "./answer.js";
import { ratios } from "./numbers.js";
import { labelled } from "./page.js";

/**
 * @typedef {import("./spectrum.js").Spectrum} Spectrum
 */

/** The frequency parameters at which a spectrum is asked [1/s²]. */
export const SIZES = ratios(0.1, 30, 41).map((p2) => Number(p2.toPrecision(4)));

/** A record to try: one sine, no earthquake. */
export function syntheticPulse() {
  const [amplitude_g, duration_s, count] = [0.35, 0.8, 160];
  const rows = Array.from({ length: count + 1 }, (_, i) => {
    const a = amplitude_g * Math.sin((2 * Math.PI * i) / count);
    return `${((duration_s * i) / count).toFixed(4)},${a.toFixed(6)}`;
  });
  const text = ["time_s,acceleration_g", ...rows, ""].join("\n");
  return new File([text], "synthetic pulse, one sine of 0.35 g and 0.8 s");
}

/**
 * Both polarities of an answer of /v1/spectrum as one spectrum.
 * @param {any[]} answers
 * @param {string} name under which it is shown
 * @returns {Spectrum}
 */
export function spectrumOf(answers, name) {
  const of = (/** @type {string} */ polarity) => answers.find((each) => each.polarity === polarity);
  const [forward, reverse] = [of("forward"), of("reverse")];
  return {
    name,
    pgv_m_s: forward.pgv_m_s,
    p2: forward.p2,
    forward: forward.x_m_s,
    reverse: reverse.x_m_s,
    warnings: labelled(forward.diagnostics),
    texts: answers.map(spoken),
    verdict: null,
  };
}

/**
 * A spectrum as the part of an address behind "#", which a browser sends to nobody.
 * @param {Spectrum | null} spectrum
 * @returns {string}
 */
export function toFragment(spectrum) {
  if (!spectrum) return "";
  const short = (/** @type {number} */ v) => Number(v.toPrecision(5));
  const text = JSON.stringify({
    ...spectrum,
    p2: spectrum.p2,
    forward: spectrum.forward.map(short),
    reverse: spectrum.reverse.map(short),
  });
  const bytes = Array.from(new TextEncoder().encode(text), (b) => String.fromCharCode(b)).join("");
  return `spectrum=${btoa(bytes).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "")}`;
}

/**
 * The spectrum that a part of an address holds.
 * @param {string} fragment what stands behind "#"
 * @returns {Spectrum | null} null if there is none, or none that can be read
 */
export function fromFragment(fragment) {
  const [, packed] = fragment.match(/^spectrum=([\w-]+)$/) ?? [];
  if (!packed) return null;
  try {
    const bytes = atob(packed.replaceAll("-", "+").replaceAll("_", "/"));
    const text = new TextDecoder().decode(Uint8Array.from(bytes, (c) => c.charCodeAt(0)));
    const read = JSON.parse(text);
    const lists = [read.p2, read.forward, read.reverse];
    const sound = lists.every(
      (list) =>
        Array.isArray(list) && list.length === read.p2.length && list.every(Number.isFinite),
    );
    return sound && read.p2.length > 1 && Number.isFinite(read.pgv_m_s)
      ? {
          ...read,
          name: String(read.name),
          warnings: [...read.warnings].map(String),
          texts: pairsOf(read.texts),
          verdict: read.verdict && { ...read.verdict, texts: pairsOf(read.verdict.texts) },
        }
      : null;
  } catch {
    return null;
  }
}

/** @type {(texts: any) => import("./answer.js").Texts} */
function pairsOf(texts) {
  return [...texts].map(([headline, rest]) => [String(headline), String(rest)]);
}

/**
 * Take files dropped anywhere on the page, or chosen by the button.
 * @param {HTMLElement} zone shown as ready while a file is over the page
 * @param {HTMLInputElement} button
 * @param {(file: File) => void} taken
 */
export function recordsFrom(zone, button, taken) {
  const ready = (/** @type {boolean} */ is) => zone.classList.toggle("ready", is);
  addEventListener("dragover", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    ready(true);
  });
  addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) ready(false);
  });
  addEventListener("drop", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    ready(false);
    const [file] = event.dataTransfer.files;
    if (file) taken(file);
  });
  button.addEventListener("change", () => {
    const [file] = button.files ?? [];
    if (file) taken(file);
    button.value = "";
  });
}
