/** Letters of the patient's directions at the edges of a picture, and a scale bar in millimetres. */
import { cross, unit } from "../camera.js";

/** @typedef {import("../camera.js").Camera} Camera */
/** @typedef {import("./stage.js").Stage} Stage */

const SVG = "http://www.w3.org/2000/svg";
/** DICOM's letters for the directions of LPS: right and left, front (anterior) and back (posterior), feet and head. */
const NAMES = [
  ["R", "L"],
  ["A", "P"],
  ["F", "H"],
];
/** A direction that contributes less than this to an edge is not named. */
const LEAST = 0.3;
/** The bar takes at most this share of the picture's width. */
const SHARE = 0.25;

/**
 * The letters of a direction in the patient's space, the strongest first, as "LA".
 * @param {readonly number[]} direction x, y, z in LPS
 */
export function letters(direction) {
  return unit(direction)
    .map((each, axis) => ({ size: Math.abs(each), name: NAMES[axis][Number(each > 0)] }))
    .filter(({ size }) => size > LEAST)
    .sort((a, b) => b.size - a.size)
    .map(({ name }) => name)
    .join("");
}

/** Letters of the right, left, upper and lower edge of a picture. @param {Camera} camera */
export function edges({ forward, up }) {
  const right = unit(cross(unit(forward), up));
  const above = cross(right, unit(forward));
  const negative = (/** @type {number[]} */ each) => each.map((one) => -one);
  return [right, negative(right), above, negative(above)].map(letters);
}

/**
 * The longest length of the form 1, 2 or 5 times a power of ten that is not above a limit.
 * @param {number} most millimetres
 */
export function roundLength(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return power * (most >= 5 * power ? 5 : most >= 2 * power ? 2 : 1);
}

/** A length with its unit. @param {number} mm */
export const lengthText = (mm) => (mm < 0.1 ? `${Number((mm * 1000).toPrecision(3))} µm` : `${mm} mm`);

/** Letters and a bar over one canvas. */
export class Annotations {
  #canvas;
  #stage;
  /** Drawn over the canvas. */
  marks = document.createElementNS(SVG, "svg");

  /** @param {HTMLCanvasElement} canvas @param {Stage} stage */
  constructor(canvas, stage) {
    this.#canvas = canvas;
    this.#stage = stage;
    this.marks.setAttribute("part", "annotations");
    this.marks.setAttribute("role", "img");
    this.marks.style.cssText =
      "position: absolute; inset: 0; width: 100%; height: 100%; pointer-events: none; font: 600 13px system-ui, sans-serif";
  }

  /**
   * Follows a new picture.
   * @param {number} [top] pixels at the upper edge that something else covers @param {number} [bottom] at the lower one
   */
  place(top = 0, bottom = 0) {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    if (!width || !height) return;
    const { camera } = this.#stage.orbit;
    const [right, left, above, below] = edges(camera);
    // In perspective the bar holds at the distance of the volume's middle.
    const mm = (camera.height * Math.max(1, height / width)) / height;
    const length = roundLength(SHARE * width * mm);
    const pixels = length / mm;
    const lowest = height - bottom;
    const middle = (top + lowest) / 2;
    const [x, y] = [width - 14 - pixels, lowest - 14];
    const text = lengthText(length);
    this.marks.replaceChildren(
      written(right, width - 8, middle, "end"),
      written(left, 8, middle, "start"),
      written(above, width / 2, top + 20, "middle"),
      written(below, width / 2, lowest - 10, "middle"),
      path(`M${x} ${y - 5}v10m0 -5h${pixels}m0 -5v10`),
      written(text, x + pixels / 2, y - 9, "middle"),
    );
    const far = camera.projection === "perspective" ? " at the distance of its middle" : "";
    this.marks.setAttribute(
      "aria-label",
      `Right: ${right}, left: ${left}, up: ${above}, down: ${below}. The bar is ${text} long${far}.`,
    );
  }
}

/** Text with an outline, so that it can be read over everything. @param {string} text @param {number} x @param {number} y @param {string} anchor */
function written(text, x, y, anchor) {
  const made = document.createElementNS(SVG, "text");
  for (const [key, value] of Object.entries({ x, y, "text-anchor": anchor, ...OUTLINED }))
    made.setAttribute(key, String(value));
  made.textContent = text;
  return made;
}

const OUTLINED = {
  fill: "#fff",
  stroke: "#000",
  "stroke-width": 3,
  "paint-order": "stroke",
  "stroke-linejoin": "round",
};

/** A white line with a dark border. @param {string} d */
function path(d) {
  const group = document.createElementNS(SVG, "g");
  for (const [stroke, width] of [
    ["#000", 4],
    ["#fff", 2],
  ]) {
    const made = document.createElementNS(SVG, "path");
    for (const [key, value] of Object.entries({ d, stroke, "stroke-width": width, fill: "none" }))
      made.setAttribute(key, String(value));
    group.append(made);
  }
  return group;
}
