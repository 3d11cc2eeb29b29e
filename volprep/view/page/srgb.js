/** Colours of style sheets, which are sRGB, and linear light. */
import { linearOf } from "../runtime/formats.js";
import { encodedOf } from "../runtime/slices.js";

/** @param {readonly number[]} colour linear, 0 to 1 @returns {string} #rrggbb */
export function css(colour) {
  const bytes = colour.map((value) => Math.round(Math.min(Math.max(encodedOf(value), 0), 1) * 255));
  return `#${bytes.map((byte) => byte.toString(16).padStart(2, "0")).join("")}`;
}

/** @param {string} text #rrggbb @returns {[number, number, number]} linear, 0 to 1 */
export function linear(text) {
  const one = (/** @type {number} */ at) => linearOf(parseInt(text.slice(at, at + 2), 16) / 255);
  return [one(1), one(3), one(5)];
}
