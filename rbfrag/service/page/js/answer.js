/** The panel of the answer: number, interval, words, warnings, other models. */

import { d3 } from "./d3.js";
import { afterPause } from "./latest.js";
import { quantity, readable } from "./numbers.js";
import { byId } from "./page.js";
import { atSites, drainedBound, inOneSentence, percent, ranges, verbOf } from "./percent.js";
import { writeText } from "./subscripts.js";

const SPOKEN_AFTER_MS = 700;

/** What is known of the motion, by the term of a model. */
const KNOWS = {
  pgv: "PGV",
  pga_tm: "PGA, T_m",
  pgd_tm: "PGD, T_m",
  pgv_pga: "PGV, PGA",
  pgv_pga_tm: "PGV, PGA, T_m",
  pgv_kr: "PGV",
  pga: "PGA",
  pgv_pga_sa10_sa30: "PGV, PGA, SA(1, 3 s)",
  sa10: "SA(1 s)",
  pga_sa10: "PGA, SA(1 s)",
  pga_sa03_sa10_sa30: "PGA, SA(0.3, 1, 3 s)",
  pga_sa10_sa30: "PGA, SA(1, 3 s)",
  pga_m: "PGA, M",
  pgv_pga_m: "PGV, PGA, M",
  pgv_pga_ia: "PGV, PGA, Arias intensity",
};

/** How the sentence of the service begins that the page says in its own place. */
const SAID = /^no friction angle is given/;

/** How the question about a unit begins, which stands before the answer. */
const UNIT = "Check the unit";

/** An equals sign that does not part from what stands beside it. */
const IS = "\u00a0=\u00a0";

const speak = afterPause(SPOKEN_AFTER_MS, (/** @type {string} */ text) => {
  byId("live").textContent = text;
});

/**
 * Show an answer of /v1/predict.
 * @param {any} answer
 */
export function showAnswer(answer) {
  const interval = `${percent(answer.ci_low)} to ${percent(answer.ci_high)}`;
  const range = answer.in_domain
    ? "within the fitted range"
    : "outside the fitted range: an extrapolation";
  byId("probability").textContent = percent(answer.probability);
  const questions = answer.warnings.filter((/** @type {string} */ text) => text.startsWith(UNIT));
  byId("sentence").textContent = [...questions, inOneSentence(answer)].join(" ");
  writeText(byId("in-words"), [ranges(answer), drainedBound(answer)].filter(Boolean).join(" "));
  const domain = byId("domain");
  domain.textContent = range;
  domain.dataset.inside = String(answer.in_domain);
  writeText(
    byId("about"),
    `Model ${answer.model} of ${answer.data}. ` +
      `Intensity ${quantity(answer.intensity_m_s, "m/s")}` +
      (answer.y_m_s === null
        ? ""
        : `, velocity of the block y${IS}k\u00a0g/p${IS}${quantity(answer.y_m_s, "m/s")}`) +
      ".",
  );
  drawMeter(answer);
  showWarnings(
    byId("warnings"),
    answer.warnings.filter((/** @type {string} */ each) => !SAID.test(each)),
  );
  showOthers(answer.answers);
  byId("strip").textContent = `${percent(answer.probability)} ${verbOf(answer)} (${interval})`;
  mark("known");
  const event =
    answer.event_low === null
      ? ""
      : ` At ${atSites(answer)} ${percent(answer.event_low)} to ${percent(answer.event_high)}.`;
  const failure = `Probability of ${answer.failure.replace("permanent displacement above", "sliding more than")}`;
  byId("answer-title").textContent = failure;
  speak(`${failure} ${percent(answer.probability)}, ${interval}, ${range}.${event}`);
}

/**
 * Say what is taken of a block that has an answer.
 * @param {import("./question.js").Question} question
 * @param {any} found answer of /v1/drawing
 */
export function sayOfBlock({ shape, values }, { numbers }) {
  const { p2, kr, ky, ks, ps2, kct, pct2 } = numbers;
  const strength =
    kr !== undefined
      ? `p²${IS}${quantity(p2, "1/s²")} and k_r${IS}${quantity(kr, "g")}`
      : ky !== undefined
        ? `k_y${IS}${quantity(ky, "g")}`
        : ks !== undefined
          ? `p_s²${IS}${quantity(ps2, "1/s²")} and k_s${IS}${quantity(ks, "g")}`
          : `p_ct²${IS}${quantity(pct2, "1/s²")} and k_ct${IS}${quantity(kct, "g")}`;
  const verb = ky === undefined ? "follow" : "follows";
  const rough = shape === "rectangle" && values.phi === "" ? ", and rough enough not to slide" : "";
  const stands = `The block is taken as ${values.kind ? "free-standing" : "backed by a slope"}${rough}`;
  const from = shape === "rectangle" ? "height, width and dip" : shape;
  const words = shape === "numbers" ? `, with ${strength}.` : `; from its ${from} ${verb} ${strength}.`;
  writeText(byId("taken"), stands + words);
}

/**
 * Say something more of the model that has answered.
 * @param {string} sentence
 */
export function sayOfModel(sentence) {
  const about = byId("about");
  if (!about.textContent?.includes(sentence)) about.append(sentence);
}

/** Put the answer of the reader's own record before that of the measures.
 * @param {{name: string, answer: string, words: string} | null} verdict */
export function showByRecord(verdict) {
  byId("by-record").hidden = !verdict;
  byId("by-record-title").textContent = verdict ? `Does ${verdict.name} topple it?` : "";
  byId("by-record-answer").textContent = verdict?.answer ?? "";
  writeText(byId("by-record-words"), verdict?.words ?? "");
  byId("strip").dataset.record = verdict ? `record: ${verdict.answer.toLowerCase()} · ` : "";
}

/**
 * Show that there is no answer, and why.
 * @param {string} why
 * @param {string[]} [warnings] about the block
 */
export function showNoAnswer(why, warnings = []) {
  byId("probability").textContent = "\u2013";
  byId("answer-title").textContent = "No probability";
  byId("sentence").textContent = why;
  for (const id of ["in-words", "taken", "domain", "about"]) byId(id).textContent = "";
  delete byId("domain").dataset.inside;
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
      KNOWS[/** @type {keyof typeof KNOWS} */ (each.term)] ?? each.term,
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
