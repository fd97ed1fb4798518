/** The page: what the reader asks, what the service answers, and who shows it. */

import { showAnswer, showNoAnswer } from "./answer.js";
import { Refusal, Unreachable } from "./ask.js";
import { blockDrawing } from "./block.js";
import { formFields, inLabels, nothingWrong, sayWrong } from "./fields.js";
import { figures } from "./figures.js";
import { afterPause, latest } from "./latest.js";
import { addressOf, fromAddress, showAddress } from "./link.js";
import { offerModelsOf } from "./models.js";
import { forField, fromField } from "./numbers.js";
import { byId, labelled } from "./page.js";
import { measuresOf, USUAL_PHI, withMeasure } from "./question.js";
import { recordPanel } from "./record_panel.js";
import * as service from "./service.js";
import { blockTable } from "./table.js";
import { tools } from "./tools.js";
import { reached, tokenMissing, unreachable, whenTokenGiven } from "./trouble.js";
import { loadVocabulary } from "./vocabulary.js";

/** @typedef {import("./question.js").Question} Question */

const TYPING_MS = 180;

const start = fromAddress();
let question = start.question;
/** What predictions read of the block that is shown. @type {Record<string, number>} */
let numbers = {};

const form = /** @type {HTMLFormElement} */ (byId("form"));
const fields = formFields(form, fieldsChanged);
const drawing = blockDrawing(byId("block"));
const sheets = figures({ to: pointMoved, by: pointStepped }, failed);
const record = recordPanel({
  changed: () => showAddress(addressOf(question, record.shown())),
  takePgv: (pgv) => set({ pgv: forField(pgv) }),
});
const ask = latest(answerQuestion);
const askSoon = afterPause(TYPING_MS, () => ask(question));

// --- what the reader does ---

/** @type {(now: Question, shapeWas: string, whole: boolean) => void} */
function fieldsChanged(now, shapeWas, whole) {
  const kindWas = question.values.kind;
  question = now;
  // no model answers for both
  if (now.values.kind !== kindWas) question.values.model = "";
  if (now.shape === "numbers" && shapeWas !== "numbers" && numbers.kr > 0) {
    // the same block, as the two numbers that the service gave for its shape
    const { p2, kr } = numbers;
    question.values = { ...now.values, p2: forField(p2), kr: forField(kr) };
  }
  if (["angles", "fractures"].includes(now.shape) && now.shape !== shapeWas) {
    question.values.phi ||= USUAL_PHI;
  }
  if (now.values.kind !== kindWas || now.shape !== shapeWas) fields.show(question);
  sheets.stale();
  sheets.letGo();
  drawing.upToDate(false);
  busy(true);
  if (whole) askSoon();
}

/** @type {(across: string, x: number, kr: number | null) => void} */
function pointMoved(across, x, kr) {
  const values = withMeasure(question.values, across, x);
  if (kr !== null) values.kr = forField(kr);
  sheets.movePoint(measuresOf(values)[across], kr === null ? null : fromField(values.kr));
  set(values);
}

/** A step starts from what the fields say, even where that is not answered yet.
 * @type {(across: string, ratioOfX: number, ratioOfKr: number) => void} */
function pointStepped(across, ratioOfX, ratioOfKr) {
  const x = measuresOf(question.values)[across] * ratioOfX;
  const kr = ratioOfKr === 1 ? null : fromField(question.values.kr) * ratioOfKr;
  if (x > 0 && (kr === null || kr > 0)) pointMoved(across, x, kr);
}

/** @param {Record<string, string>} values */
function set(values) {
  question = { ...question, values: { ...question.values, ...values } };
  fields.show(question);
  busy(true);
  ask(question);
}

/**
 * Say whether answers to the present question are still to come.
 * @param {boolean} is
 */
function busy(is) {
  byId("main").setAttribute("aria-busy", String(is));
}

// --- what the service answers ---

/** @param {Question} asked */
async function answerQuestion(asked) {
  showAddress(addressOf(asked, record.shown()));
  try {
    await loadVocabulary(); // labels, units and names of what is shown below
    const found = await service.askDrawing(asked);
    numbers = found.numbers ?? {};
    drawing.show(found, asked);
    offerModelsOf(found.kind);
    byId("sliding-part").hidden = found.kind !== "sliding";
    const answer = found.reason ? null : await service.askProbability(asked, found.kind);
    reached();
    nothingWrong(form);
    if (!answer) {
      sheets.hide();
      return nothingKnown(found.reason, labelled(found.block.diagnostics));
    }
    showAnswer(answer);
    if (!found.numbers) {
      // unstable at rest: P = 1 for any shaking
      sheets.hide();
      record.placeBlock(null);
      return busy(asked !== question);
    }
    await sheets.show(asked, answer, found, () => asked === question);
    // X(p) bounds what a block does that a slope backs
    if (found.kind === "toppling") {
      const { p2, kr } = found.numbers;
      record.placeBlock({ p2, kr, y: answer.y_m_s }, found.rectangle_r3_m * p2);
    } else record.placeBlock(null);
    busy(asked !== question);
  } catch (error) {
    failed(error);
  }
}

/** @type {(why: string, warnings?: string[]) => void} */
function nothingKnown(why, warnings) {
  busy(false);
  showNoAnswer(why, warnings);
  sheets.showNoAnswer();
  record.placeBlock(null);
}

/** @param {unknown} error */
function failed(error) {
  sheets.stale();
  if (error instanceof Unreachable) return unreachable(error, () => ask(question));
  if (!(error instanceof Refusal)) throw error;
  nothingWrong(form);
  if (error.status === 401) {
    tokenMissing();
    return nothingKnown(document.querySelector("#token-form label")?.textContent ?? "");
  }
  reached();
  sayWrong(error.message, byId("form-error"));
  nothingKnown(inLabels(error.message));
}

blockTable(() => question);
whenTokenGiven(() => ask(question));
tools(() => addressOf(question, record.shown()));
service.askVersion().then(
  (version) => (byId("service-version").textContent = `rbfrag ${version}`),
  () => {}, // the answers above say that the service cannot be reached
);
fields.show(question);
if (start.spectrum) record.show(start.spectrum);
ask(question);
