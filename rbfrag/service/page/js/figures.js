/** Design chart and fragility curve: what they ask, and whether they answer the present question. */

import { showSensitivity } from "./answer.js";
import { Refusal } from "./ask.js";
import { designChart } from "./chart.js";
import { fragilityCurve } from "./curve.js";
import { latest } from "./latest.js";
import { modelNamed } from "./models.js";
import { quantity } from "./numbers.js";
import { byId } from "./page.js";
import { percent } from "./percent.js";
import { planeOf } from "./plane.js";
import { measuresOf } from "./question.js";
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
      const others = [question.values.restitution, othersOf(question, on)];
      const key = JSON.stringify([answer.model, on, failing.numbers.restitution, others]);
      try {
        if (key !== gridShown) chart.showGrid(await askGrid(on, answer.model, failing, question));
        gridShown = key;
        chart.upToDate(present());
      } catch (error) {
        notDrawn(error, "chart");
      }
    },
  );

  const drawCurve = latest(async (/** @type {Answered} */ asked) => {
    const { question, answer, plane: on, failing, present } = asked;
    try {
      curve.showCurve(await askCurve(on, answer.model, failing, question));
      curve.upToDate(present());
    } catch (error) {
      notDrawn(error, "curve");
    }
  });

  /**
   * What a figure lacks does not take the answer away.
   * @param {unknown} error
   * @param {string} figure
   */
  function notDrawn(error, figure) {
    if (!(error instanceof Refusal)) return failed(error);
    showCaption(figure, error.message);
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
      showSensitivity(model?.sensitive_share ?? 0);
      const { numbers } = failing;
      const domain = model?.domain ?? {};
      const measures = measuresOf(question.values);
      plane = planeOf(answer, numbers, measures, domain, held ? plane : null);
      const x = measures[plane.across] ?? NaN;
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
      if (hasChart) {
        byId("chart-failure").textContent = answer.failure;
        writeText(byId("chart-at"), fixedValues(question, plane));
        showCaption("chart");
      }
      byId("curve-level").textContent = percent(answer.level);
      byId("curve-sites").hidden = answer.event_low === null;
      showCaption("curve");
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
 * Show the caption of a figure, or why it is not drawn.
 * @param {string} figure
 * @param {string} [error]
 */
function showCaption(figure, error = "") {
  byId(`${figure}-meaning`).hidden = Boolean(error);
  byId(`${figure}-error`).textContent = error;
}

/** The measures that do not run across, by name.
 * @type {(question: Question, plane: Plane) => [string, number][]} */
function othersOf(question, plane) {
  return Object.entries(measuresOf(question.values)).filter(([name]) => name !== plane.across);
}

/** Values for which the chart is drawn.
 * @type {(question: Question, plane: Plane) => string} */
function fixedValues(question, plane) {
  const held = othersOf(question, plane).map(([name, value]) => {
    const { symbol, unit } = quantityNamed(name);
    return `${symbol} = ${quantity(value, unit)}`;
  });
  return [`p² = ${quantity(plane.p2, "1/s²")}`, ...held].join(", ");
}
