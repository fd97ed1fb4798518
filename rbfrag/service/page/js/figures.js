/** Design chart and fragility curve: what they ask, and whether they answer the present question. */

import { sayOfModel } from "./answer.js";
import { Refusal } from "./ask.js";
import { designChart } from "./chart.js";
import { fragilityCurve } from "./curve.js";
import { latest } from "./latest.js";
import { modelNamed } from "./models.js";
import { fromField, quantity } from "./numbers.js";
import { byId } from "./page.js";
import { percent } from "./percent.js";
import { labelOf, planeOf } from "./plane.js";
import { MEASURES } from "./question.js";
import { askCurve, askGrid } from "./service.js";
import { writeText } from "./subscripts.js";
import { quantityNamed } from "./vocabulary.js";

/**
 * @typedef {import("./question.js").Question} Question
 * @typedef {import("./plane.js").Plane} Plane
 * @typedef {import("./plane.js").Across} Across
 * @typedef {import("./service.js").Failing} Failing
 * @typedef {{question: Question, answer: any, plane: Plane, failing: Failing,
 *   present: () => boolean}} Answered
 */

/**
 * Both figures.
 * @param {{to: (across: Across, x: number, kr: number | null) => void,
 *   by: (across: Across, ratioOfX: number, ratioOfKr: number) => void}} moved called when the reader
 *   moves the point: the measure that runs across, and to where or by which step
 * @param {(error: unknown) => void} failed called when the service does not answer
 */
export function figures(moved, failed) {
  /** @type {Plane | null} */
  let plane = null;
  /** While the point is moved, the chart stays where it is. */
  let held = false;
  let gridShown = "";
  const chart = designChart(byId("chart"), {
    to: (x, kr) => plane && moved.to(plane.across, x, kr),
    by: (ofX, ofKr) => plane && moved.by(plane.across, ofX, ofKr),
  });
  const curve = fragilityCurve(byId("curve"));

  const drawGrid = latest(
    async (/** @type {Answered} */ { question, answer, plane: on, failing, present }) => {
      const others = ["restitution", ...MEASURES]
        .filter((name) => name !== on.across)
        .map((name) => question.values[name]);
      const key = JSON.stringify([answer.model, on, failing.numbers.restitution, others]);
      try {
        if (key !== gridShown) chart.showGrid(await askGrid(on, answer.model, failing, question));
        gridShown = key;
        chart.upToDate(present());
      } catch (error) {
        notDrawn(error, "chart-caption");
      }
    },
  );

  const drawCurve = latest(async (/** @type {Answered} */ asked) => {
    const { question, answer, plane: on, failing, present } = asked;
    try {
      curve.showCurve(await askCurve(on, answer.model, failing, question));
      curve.upToDate(present());
    } catch (error) {
      notDrawn(error, "curve-caption");
    }
  });

  /**
   * What a figure lacks does not take the answer away.
   * @param {unknown} error
   * @param {string} caption
   */
  function notDrawn(error, caption) {
    if (!(error instanceof Refusal)) return failed(error);
    byId(caption).textContent = `Not drawn for the present block: ${error.message}`;
  }

  return {
    /**
     * Show an answer, and ask for what surrounds it.
     * @param {Question} question
     * @param {any} answer of /v1/predict
     * @param {Failing} failing
     * @param {() => boolean} present whether the reader still asks this
     */
    async show(question, answer, failing, present) {
      const model = await modelNamed(answer.model);
      if (model?.sensitive_share) sayOfModel(sensitivity(model.sensitive_share));
      const { numbers } = failing;
      const domain = model?.domain ?? {};
      plane = planeOf(answer, numbers, question.values, domain, held ? plane : null);
      const x = fromField(question.values[plane.across]);
      const { kr } = numbers;
      const { probability } = answer;
      // the chart is about strength in rotation
      const hasChart = kr !== undefined;
      byId("chart-part").hidden = !hasChart;
      byId("curve-part").hidden = false;
      if (hasChart && present()) {
        chart.showPoint({ plane, x, kr, yIsFree: question.shape === "numbers", probability });
      }
      curve.showSpot({ x, ...answer });
      const asked = { question, answer, plane, failing, present };
      if (hasChart) drawGrid(asked);
      else chart.upToDate(true);
      drawCurve(asked);
      if (hasChart) writeText(byId("chart-caption"), chartCaption(question, answer, plane));
      byId("curve-caption").textContent =
        `Dark band: ${percent(answer.level)} confidence interval.` +
        (answer.event_low === null ? "" : " Light band: prediction interval at the sites.");
    },
    /**
     * Show the point where the reader has moved it, before there is an answer.
     * @param {number} x
     * @param {number | null} kr null where it stays as it is
     */
    movePoint(x, kr) {
      held = true;
      chart.movePoint(x, kr);
    },
    /** The point is no longer moved: the ranges follow the fields again. */
    letGo() {
      held = false;
    },
    /** Show that the figures do not answer the present question. */
    stale() {
      chart.upToDate(false);
      curve.upToDate(false);
    },
    /** Show that what is asked has no answer. */
    showNoAnswer() {
      this.stale();
      chart.hidePoint();
      curve.showSpot(null);
    },
    /** Take them away: no earthquake decides about the present block. */
    hide() {
      for (const id of ["chart-part", "curve-part"]) byId(id).hidden = true;
    },
  };
}

/**
 * What the sensitive outcomes of free-standing blocks mean for an answer.
 * @param {number} share
 */
function sensitivity(share) {
  return (
    ` Of the simulated outcomes behind it ${percent(share)} are sensitive: others for a motion ` +
    "that differs by a millionth."
  );
}

/** @type {(question: Question, answer: any, plane: Plane) => string} */
function chartCaption(question, answer, plane) {
  const held = MEASURES.filter((name) => name !== plane.across && question.values[name] !== "").map(
    (name) => {
      const { symbol, unit } = quantityNamed(name);
      return `${symbol} = ${quantity(fromField(question.values[name]), unit)}`;
    },
  );
  const all = [`p² = ${quantity(plane.p2, "1/s²")}`, ...held].join(", ");
  return (
    `Lines of equal probability of ${answer.failure} at ${all}. ` +
    "Hatched: outside the fitted range, where answers are extrapolations."
  );
}
