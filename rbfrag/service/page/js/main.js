/** The page: what the reader asks, what the service answers, and who shows it. */

import { showAnswer, showNoAnswer } from "./answer.js";
import { Refusal, Unreachable } from "./ask.js";
import { blockDrawing, blockInWords } from "./block.js";
import { formFields, nothingWrong, sayWrong } from "./fields.js";
import { figures } from "./figures.js";
import { afterPause, latest } from "./latest.js";
import { addressOf, fromAddress, showAddress } from "./link.js";
import { offerModelsOf } from "./models.js";
import { forField, fromField } from "./numbers.js";
import { byId } from "./page.js";
import { recordPanel } from "./record_panel.js";
import * as service from "./service.js";
import { tools } from "./tools.js";
import { reached, tokenMissing, unreachable, whenTokenGiven } from "./trouble.js";

/** @typedef {import("./question.js").Question} Question */

const TYPING_MS = 180;

const start = fromAddress();
let question = start.question;
/** The block as /v1/block describes it; null where it is two numbers. @type {any} */
let block = null;

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
  if (now.values.kind !== kindWas) {
    // numbers are all that a free-standing block is given by, and no model answers for both
    question = { shape: "numbers", values: { ...now.values, model: "" } };
    fields.show(question);
  } else if (now.shape !== shapeWas) {
    if (now.shape === "numbers" && block?.kr > 0) {
      // the same block, as the two numbers that the service gave for its shape
      const numbers = { p2: forField(block.p2), kr: forField(block.kr) };
      question = { ...now, values: { ...now.values, ...numbers } };
    }
    fields.show(question);
  }
  sheets.stale();
  drawing.upToDate(false);
  busy(true);
  if (whole) askSoon();
}

/** @type {(across: string, x: number, kr: number | null) => void} */
function pointMoved(across, x, kr) {
  /** @type {Record<string, string>} */
  const values = { [across]: forField(x) };
  if (kr !== null) values.kr = forField(kr);
  sheets.movePoint(fromField(values[across]), kr === null ? null : fromField(values.kr));
  set(values);
}

/** A step starts from what the fields say, even where that is not answered yet.
 * @type {(across: string, ratioOfX: number, ratioOfKr: number) => void} */
function pointStepped(across, ratioOfX, ratioOfKr) {
  const x = fromField(question.values[across]) * ratioOfX;
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
  showAddress(addressOf(question, record.shown()));
  offerModelsOf(asked.values.kind);
  try {
    const [lines, found] = await Promise.all([
      service.askDrawing(asked).catch(notRefused),
      asked.shape === "numbers" ? null : service.askBlock(asked),
    ]);
    block = found;
    if (lines) drawing.show(lines, block);
    const noAnswer = block && whyNoAnswer(block);
    const { p2, kr } = block ?? asked.values;
    const two = { p2: String(p2), kr: String(kr) };
    const answer = noAnswer ? null : await service.askProbability(two, asked);
    reached();
    nothingWrong(form);
    if (!answer) return nothingKnown(noAnswer);
    showAnswer(answer);
    const place = { p2: fromField(two.p2), kr: fromField(two.kr) };
    await sheets.show(asked, answer, place, () => asked === question);
    const size = lines?.rectangle_r3_m * place.p2;
    // X(p) bounds what a block does that a slope backs
    if (asked.values.kind) record.placeBlock(null);
    else record.placeBlock({ p2: place.p2, y: answer.y_m_s }, size);
    busy(asked !== question);
  } catch (error) {
    failed(error);
  }
}

/**
 * What a block lacks for a drawing, the other answers say in better words.
 * @param {unknown} error
 */
function notRefused(error) {
  if (error instanceof Refusal) return null;
  throw error;
}

/** @param {any} found answer of /v1/block */
function whyNoAnswer(found) {
  if (found.mode === "topple" && found.state === "stable" && found.kr > 0) return "";
  return `${blockInWords(found)} The probability here is that of toppling alone.`;
}

/** @param {string} why */
function nothingKnown(why) {
  busy(false);
  showNoAnswer(why);
  sheets.showNoBlock();
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
    return nothingKnown("The service asks for its token.");
  }
  reached();
  sayWrong(error.message, byId("form-error"));
  nothingKnown(error.message);
}

whenTokenGiven(() => ask(question));
tools(
  () => addressOf(question, record.shown()),
  () => addressOf(question, null),
);
service.askVersion().then(
  (version) => (byId("service-version").textContent = `rbfrag ${version}`),
  () => {}, // the answers above say that the service cannot be reached
);
fields.show(question);
if (start.spectrum) record.show(start.spectrum);
ask(question);
