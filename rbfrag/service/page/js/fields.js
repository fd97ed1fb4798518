/** The fields of the form: texts in, texts out, and what is wrong next to the field. */

import { plain } from "./numbers.js";
import { byId } from "./page.js";
import { BLOCK_FIELDS, DEFAULTS, ERROR_FIELDS, FURTHER, MEASURES, MODEL_FIELDS } from "./question.js";
import { quantityNamed } from "./vocabulary.js";

/**
 * @typedef {import("./question.js").Question} Question
 * @typedef {import("./question.js").Shape} Shape
 */

const NAMES = [
  ...Object.values(ERROR_FIELDS).flat(), // before the fields that their names begin with
  ...[...Object.values(BLOCK_FIELDS).flat(), "restitution", "displacement"],
  ...[...MEASURES, ...MODEL_FIELDS, "units", "dt", "trace"],
];

/** Names of fields as they stand in the service's sentences, with or without their unit. */
const NAMED = new RegExp(`(?<![\\w.])(${NAMES.join("|")})(?:_m_s|_deg|_g|_s|_m)?(?!\\w)`, "g");

/**
 * The form of block, shaking and model.
 * @param {HTMLFormElement} form
 * @param {(question: Question, shapeWas: Shape, whole: boolean) => void} changed called with whether
 *   the reader may ask, which half of a number is no reason for
 */
export function formFields(form, changed) {
  const inputs = () =>
    /** @type {HTMLInputElement[]} */ ([...form.querySelectorAll("input[id], select[id]")]);
  const radios = (/** @type {string} */ name) =>
    /** @type {HTMLInputElement[]} */ ([...form.querySelectorAll(`input[name=${name}]`)]);
  /** @type {Shape} */
  let shape = "rectangle";

  /** @returns {Question} */
  function read() {
    const values = Object.fromEntries(
      inputs().map((input) => [
        input.id,
        input instanceof HTMLSelectElement ? input.value : plain(input.value),
      ]),
    );
    values.kind = radios("kind").find((radio) => radio.checked)?.value ?? "";
    return { shape, values };
  }

  /** @param {Question} question */
  function show(question) {
    shape = question.shape;
    for (const input of inputs()) {
      const text = question.values[input.id] ?? "";
      if (plain(input.value) !== text) offer(input, text);
    }
    const { values } = question;
    if (FURTHER.some((name) => values[name])) open(byId("more-shaking"));
    if (ERROR_FIELDS[shape].some((name) => values[name])) open(byId("errors-part"));
    if (values.model || values.sites || values.level !== DEFAULTS.level) open(byId("model-part"));
    const { kind } = question.values;
    for (const radio of radios("shape")) radio.checked = radio.value === shape;
    for (const radio of radios("kind")) radio.checked = radio.value === kind;
    for (const part of form.querySelectorAll("[data-shape], [data-kind]")) {
      const own = /** @type {HTMLElement} */ (part);
      const { shape: of = shape, kind: standing = kind } = own.dataset;
      own.hidden = !(of.split(" ").includes(shape) && standing === kind);
    }
  }

  form.addEventListener("submit", (event) => event.preventDefault());
  let half = false;
  form.addEventListener("input", (event) => {
    const from = /** @type {HTMLInputElement} */ (event.target);
    const was = shape;
    if (from.name === "shape") shape = /** @type {Shape} */ (from.value);
    half = isHalfTyped(from);
    changed(read(), was, !half);
  });
  form.addEventListener("change", () => {
    if (half) changed(read(), shape, true);
    half = false;
  });
  return { show };
}

/**
 * Whether a field holds the beginning of a number, such as the 0 of 0.08, while it is typed.
 * @param {HTMLInputElement} input
 */
export function isHalfTyped(input) {
  if (document.activeElement !== input || input.inputMode === "") return false;
  const text = input.value.trim();
  const nothing = isAboveZero(input.id) && /^\+?(0+[.,]?0*|[.,]0*)$/.test(text);
  return nothing || /(^|[+-])\.$|[e+,=:-]$/i.test(text);
}

/**
 * Whether no 0 is answered of a field.
 * @param {string} id
 */
function isAboveZero(id) {
  const { above, least } = quantityNamed(id).range;
  return ["kr", "dt"].includes(id) || above === 0 || (least ?? 0) > 0;
}

/**
 * Set a field; a choice that is not offered is added, so that a link keeps what it says.
 * @param {HTMLInputElement} input
 * @param {string} text
 */
function offer(input, text) {
  if (input instanceof HTMLSelectElement && ![...input.options].some((o) => o.value === text)) {
    input.add(new Option(text, text));
  }
  input.value = text;
}

/**
 * The visible field that a sentence of the service is about, if it names one.
 * @param {string} sentence
 * @returns {HTMLElement | null}
 */
export function fieldNamedIn(sentence) {
  for (const [, name] of sentence.matchAll(NAMED)) {
    const input = document.getElementById(name);
    if (input && !input.closest("[hidden]")) return input;
  }
  return null;
}

/** A sentence of the service with the labels of the page for names of fields.
 * @param {string} sentence */
export function inLabels(sentence) {
  const named = new RegExp(`${NAMED.source}(?=[ ,]*(?:=|is|and|needs|goes|does|has))`, "g");
  const label = (/** @type {string} */ id) => document.querySelector(`label[for="${id}"]`);
  return sentence.replace(named, (word, name) => label(name)?.textContent || word);
}

/**
 * Show the error next to the field that the sentence names, or in a place for the rest.
 * @param {string} sentence
 * @param {HTMLElement} elsewhere
 */
export function sayWrong(sentence, elsewhere) {
  const input = fieldNamedIn(sentence);
  const place = (input && document.getElementById(`${input.id}-error`)) ?? elsewhere;
  place.textContent = inLabels(sentence);
  if (input) open(input);
  input?.setAttribute("aria-invalid", "true");
}

/**
 * Open what an element stands in.
 * @param {HTMLElement} element
 */
function open(element) {
  element.closest("details")?.toggleAttribute("open", true);
}

/**
 * Take back all that was wrong in a part of the page.
 * @param {HTMLElement} part
 */
export function nothingWrong(part) {
  for (const place of part.querySelectorAll(".error")) place.textContent = "";
  for (const input of part.querySelectorAll("[aria-invalid]")) {
    input.removeAttribute("aria-invalid");
  }
}
