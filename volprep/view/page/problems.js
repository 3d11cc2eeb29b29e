/** Errors for people: code, problem, remedy. Never a blank picture without a word. */
import { byId, make } from "./dom.js";

/** The words of the catalogue of volprep for what only the page finds; a test compares. @type {Record<string, [string, string]>} */
export const WORDS = {
  VP7042: ["the page failed: {reason}", "Load it again; if that does not help, report the browser and these words."],
  VP7043: [
    "the measurements did not arrive: {reason}",
    "Save it as a file, and put the file into the folder of measurements.",
  ],
};

/** An error with a permanent code, like errors of the runtime. */
export class PageError extends Error {
  /** @param {string} code @param {Record<string, unknown>} fields */
  constructor(code, fields) {
    const fill = (/** @type {string} */ text) =>
      text.replace(/\{(\w+)\}/g, (_, name) => String(fields[name]).slice(0, 300));
    const [summary, remedy] = WORDS[code].map(fill);
    super(`${code} ${summary}. ${remedy}`);
    this.code = code;
    this.summary = summary;
    this.remedy = remedy;
  }
}

/**
 * The error itself if it has a code, else one that has.
 * @param {any} error
 * @returns {{code: string, summary: string, remedy: string}}
 */
export function coded(error) {
  if (typeof error?.code === "string" && /^VP\d{4}$/.test(error.code)) return error;
  return new PageError("VP7042", { reason: error?.message ?? error });
}

/** Code, words and remedy as elements. @param {unknown} error */
export function problem(error) {
  const { code, summary, remedy } = coded(error);
  return [
    make("strong", {}, code),
    make("p", {}, `${summary[0].toUpperCase()}${summary.slice(1)}.`),
    make("p", {}, remedy),
  ];
}

/** Shows an error over the picture; null takes it away. @param {unknown} error */
export function showProblem(error) {
  const place = byId("problem");
  place.hidden = error === null;
  place.replaceChildren(...(error === null ? [] : problem(error)));
}
