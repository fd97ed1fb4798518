/** Questions to the service. The physics and the statistics are there; nothing is computed here. */

const PATIENCE_MS = 20_000;

/** A service that has just been installed compiles its programs before its first spectrum. */
const UPLOAD_PATIENCE_MS = 90_000;

let token = "";

/**
 * Use a bearer token in every question from now on. It stays in this tab and in no link.
 * @param {string} text
 */
export function useToken(text) {
  token = text;
}

/** The service refused, in its own words (RFC 9457). */
export class Refusal extends Error {
  /**
   * @param {number} status
   * @param {{title?: string, detail?: string, traces?: string[]}} problem
   */
  constructor(status, problem) {
    super(problem.detail || problem.title || `the service answered with status ${status}`);
    this.status = status;
    /** Names of the traces of a file of which one is to be named. */
    this.traces = problem.traces;
  }
}

/** The service did not answer, or has no time or no database now: the same may be asked again. */
export class Unreachable extends Error {}

const NOT_NOW = 503;

/**
 * Ask with GET.
 * @param {string} path relative to the page, as "v1/predict"
 * @param {Record<string, string | number>} [query] what is empty is left out
 * @returns {Promise<any>}
 */
export function get(path, query = {}) {
  return answer(path + search(query), {});
}

/**
 * Ask with POST and a JSON document.
 * @param {string} path
 * @param {object} document
 * @returns {Promise<any>}
 */
export function post(path, document) {
  return answer(path, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(document),
  });
}

/**
 * Send a file as it is.
 * @param {string} path
 * @param {Record<string, string | number>} query
 * @param {Blob} file
 * @returns {Promise<any>}
 */
export function upload(path, query, file) {
  const headers = { "Content-Type": "application/octet-stream" };
  return answer(path + search(query), { method: "POST", headers, body: file }, UPLOAD_PATIENCE_MS);
}

/** @param {Record<string, string | number>} query */
function search(query) {
  const given = Object.entries(query).filter(([, value]) => value !== "" && value !== undefined);
  const text = new URLSearchParams(given.map(([name, value]) => [name, String(value)]));
  return given.length ? `?${text}` : "";
}

/**
 * @param {string} path
 * @param {{method?: string, headers?: Record<string, string>, body?: BodyInit}} request
 * @param {number} [patience_ms]
 */
async function answer(path, request, patience_ms = PATIENCE_MS) {
  /** @type {Record<string, string>} */
  const headers = { Accept: "application/json", ...request.headers };
  if (token) headers.Authorization = `Bearer ${token}`;
  let response, text;
  try {
    const signal = AbortSignal.timeout(patience_ms);
    response = await fetch(path, { ...request, headers, signal, credentials: "same-origin" });
    text = await response.text();
  } catch (error) {
    throw new Unreachable("the service does not answer", { cause: error });
  }
  const document = parsed(text);
  if (response.status === NOT_NOW) throw new Unreachable(document?.detail ?? "the service is busy");
  if (!response.ok) throw new Refusal(response.status, document ?? {});
  if (document === undefined) throw new Unreachable("what answers is not this service");
  return document;
}

/** @param {string} text */
function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
}
