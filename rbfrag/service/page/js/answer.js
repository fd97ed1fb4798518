/** The panel of the answer: headline and lines as the service writes them, warnings, other models. */

import { d3 } from "./d3.js";
import { afterPause } from "./latest.js";
import { readable } from "./numbers.js";
import { byId, labelled } from "./page.js";
import { interval, percent } from "./percent.js";
import { writeText } from "./subscripts.js";
import { labelOfTerm } from "./vocabulary.js";

const SPOKEN_AFTER_MS = 700;

/** @typedef {[string, string][]} Texts headlines of answers, each with all else that they say */

const speak = afterPause(SPOKEN_AFTER_MS, (/** @type {string} */ text) => {
  byId("live").textContent = text;
});

/**
 * Show an answer of /v1/predict with its text.
 * @param {any} answer
 */
export function showAnswer(answer) {
  const { sentences, lines } = answer.text;
  const [probability, ...rest] = sentences[0].split(/ {2,}/);
  const isUnitQuestion = (/** @type {any} */ { code }) => code === "check_unit";
  const questions = answer.diagnostics.filter(isUnitQuestion);
  const texts = questions.map((/** @type {any} */ { text }) => text);
  writeText(byId("probability"), unbroken(probability));
  writeText(byId("sentence"), unbroken([...texts, ...rest].join(" ")));
  showLines(lines);
  byId("lines").dataset.inside = String(answer.in_domain);
  showSensitivity(0);
  drawMeter(answer);
  const shown = (/** @type {any} */ { text }) => !sentences[0].includes(text);
  showWarnings(byId("warnings"), labelled(answer.diagnostics.filter(shown)));
  showOthers(answer.answers);
  const headline = [probability, ...rest].join(" ");
  byId("strip").textContent = headline;
  mark("known");
  speak(`${headline}. ${lines.map((/** @type {any} */ { text }) => text).join(". ")}`);
}

/**
 * Show labelled lines.
 * @param {{label: string, text: string}[]} lines
 */
function showLines(lines) {
  byId("lines").replaceChildren(
    ...lines.flatMap(({ label, text }) => {
      const [term, value] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = label;
      writeText(value, unbroken(text));
      return [term, value];
    }),
  );
}

/**
 * A text whose percent signs stay with their numbers.
 * @param {string} text
 */
function unbroken(text) {
  return text.replaceAll(" %", "\u00a0%");
}

/**
 * Show the fraction of simulated outcomes behind the answer that are sensitive.
 * @param {number} fraction 0 for none
 */
export function showSensitivity(fraction) {
  byId("about").hidden = !fraction;
  byId("sensitive-fraction").textContent = percent(fraction);
}

/**
 * Headline of an answer, and all else that it says.
 * @param {any} answer with its text
 * @returns {[string, string]}
 */
export function spoken({ text: { sentences, lines } }) {
  const [headline, ...others] = sentences;
  return [headline, [...others, ...lines.map((/** @type {any} */ { text }) => text)].join(". ")];
}

/**
 * Show answers as paragraphs.
 * @param {HTMLElement} place
 * @param {Texts} texts
 */
export function showTexts(place, texts) {
  place.replaceChildren(
    ...texts.map(([headline, rest]) => {
      const [line, strong, other] = ["p", "strong", "span"].map((n) => document.createElement(n));
      writeText(strong, headline);
      writeText(other, rest);
      line.append(strong, ". ", other);
      return line;
    }),
  );
}

/** Put the answers of the reader's own record before that of the measures.
 * @type {(name: string, texts: Texts) => void} */
export function showByRecord(name, texts) {
  byId("by-record").hidden = !texts.length;
  byId("by-record-name").textContent = name;
  showTexts(byId("by-record-texts"), texts);
}

/**
 * Show that there is no answer, and why.
 * @param {string} why
 * @param {string[]} [warnings] about the block
 */
export function showNoAnswer(why, warnings = []) {
  byId("probability").textContent = "\u2013";
  byId("sentence").textContent = why;
  showSensitivity(0);
  showLines([]);
  d3.select("#meter").selectAll("*").remove();
  showWarnings(byId("warnings"), warnings);
  byId("others").hidden = true;
  byId("strip").textContent = "no answer";
  mark("none");
  speak(why);
}

/**
 * Show sentences of the service as they are.
 * @param {HTMLElement} list
 * @param {string[]} sentences
 */
export function showWarnings(list, sentences) {
  d3.select(list)
    .selectAll("li")
    .data(sentences)
    .join("li")
    .text((/** @type {string} */ sentence) => sentence);
  list.hidden = sentences.length === 0;
}

/** @param {string} state */
function mark(state) {
  byId("probability").dataset.state = state;
}

/**
 * The probability, its interval and the range at some sites on a line from 0 to 100 %.
 * @param {any} answer
 */
function drawMeter(answer) {
  const across = (/** @type {number} */ p) => `${(100 * p).toFixed(2)}%`;
  const meter = d3.select("#meter");
  const svg = meter.selectAll("svg").data([null]).join("svg").attr("aria-hidden", "true");
  svg.attr("width", "100%").attr("height", 34);
  /** @type {(name: string, kind: string) => any} */
  const one = (name, kind) => svg.selectAll(`.${kind}`).data([null]).join(name).attr("class", kind);
  one("rect", "scale").attr("x", 0).attr("y", 5).attr("width", "100%").attr("height", 8);
  /** @type {(kind: string, low: number, high: number) => any} */
  const range = (kind, low, high) =>
    one("rect", kind)
      .attr("x", across(low))
      .attr("y", 5)
      .attr("width", across(Math.max(high - low, 0.004)))
      .attr("height", 8);
  range("one-event", answer.event_low ?? 0, answer.event_high ?? 0).attr(
    "display",
    answer.event_low === null ? "none" : null,
  );
  range("interval", answer.ci_low, answer.ci_high);
  one("circle", "value").attr("cx", across(answer.probability)).attr("cy", 9).attr("r", 6);
  const marks = [0, 0.25, 0.5, 0.75, 1];
  svg
    .selectAll(".mark")
    .data(marks)
    .join("text")
    .attr("class", "mark")
    .attr("x", across)
    .attr("y", 30)
    .attr("text-anchor", (/** @type {number} */ p) =>
      p === 0 ? "start" : p === 1 ? "end" : "middle",
    )
    .text((/** @type {number} */ p) => `${readable(100 * p)} %`);
}

/** @param {any[]} answers */
function showOthers(answers) {
  const list = answers ?? [];
  byId("others").hidden = list.length < 2;
  d3.select("#other-answers")
    .selectAll("tr")
    .data(list)
    .join("tr")
    .attr("class", (/** @type {any} */ each) => (each.recommended ? "recommended" : null))
    .selectAll("td")
    .data((/** @type {any} */ each) => [
      each.recommended ? `${each.model} (shown)` : each.model,
      labelOfTerm(each.term),
      percent(each.probability),
      `${percent(each.ci_low)} – ${percent(each.ci_high)}`,
      each.event_low === null ? "–" : `${percent(each.event_low)} – ${percent(each.event_high)}`,
      each.in_domain ? "yes" : "no",
    ])
    .join("td")
    .each(function (/** @type {string} */ text) {
      // @ts-ignore: `this` is the element, by D3's convention
      writeText(this, text);
    });
}
