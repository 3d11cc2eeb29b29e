/** Read-out at the pointer, and the distance between two points, drawn over a canvas. */
import { invert, moved } from "../camera.js";

/** @typedef {import("./points.js").Point} Point */
/** @typedef {import("../draw/pick.js").Hit} Hit */
/** @typedef {import("./stage.js").Stage} Stage */

const SVG = "http://www.w3.org/2000/svg";
/** A pointer that has moved further than this has turned the volume. */
const CLICK_PX = 4;

/** @param {number} value */
const short = (value) => Number(value.toPrecision(4)).toString();

/** A hit as one line of text. @param {Point} hit @param {{name: string, title?: string}[]} all segments of the package */
export function words({ value, segments, position_mm: at, voxel, uncertainty_mm: half }, all) {
  const place = at.map((each) => each.toFixed(1)).join(", ");
  const cell = voxel.map((value) => Math.round(value)).join(", ");
  const titles = segments?.map((name) => all.find((each) => each.name === name)?.title ?? name) ?? [];
  const named = titles.length ? `${titles.join(" and ")}: ` : "";
  return `${named}${value === null ? "" : `value ${short(value)}, `}${place} mm, voxel ${cell}, depth ± ${short(half)} mm`;
}

/** Distance between two hits, and how wrong it may be, in millimetres. @param {Point} one @param {Point} other */
export function distance(one, other) {
  const apart = Math.hypot(...one.position_mm.map((each, i) => each - other.position_mm[i]));
  return { apart, uncertainty: one.uncertainty_mm + other.uncertainty_mm };
}

/**
 * Points on the visible volume: a click sets one, and the line to the one before has their distance. They are the
 * `points` of the stage, which points.js writes to files and reads.
 */
export class Ruler {
  #canvas;
  #stage;
  #then;
  /** Drawn over the canvas. */
  marks = document.createElementNS(SVG, "svg");

  /**
   * @param {HTMLCanvasElement} canvas @param {Stage} stage @param {AbortSignal} signal
   * @param {{say: (text: string) => void, pick: (hit: Hit | null) => void, fail: (error: unknown) => void}} then
   */
  constructor(canvas, stage, signal, then) {
    this.#canvas = canvas;
    this.#stage = stage;
    this.#then = then;
    this.marks.setAttribute("part", "marks");
    this.marks.setAttribute("aria-hidden", "true");
    this.marks.style.cssText = "position: absolute; inset: 0; width: 100%; height: 100%; pointer-events: none";
    let down = { clientX: 0, clientY: 0 };
    canvas.addEventListener("pointerdown", (event) => (down = event), { signal });
    canvas.addEventListener(
      "pointerup",
      (event) => {
        const moved = Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY);
        if (moved <= CLICK_PX) this.add(event);
      },
      { signal },
    );
    canvas.addEventListener(
      "keydown",
      ({ key }) => {
        if (key !== "Enter") return;
        const { left, top, width, height } = canvas.getBoundingClientRect();
        this.add({ clientX: left + width / 2, clientY: top + height / 2 });
      },
      { signal },
    );
  }

  /** Sets a point at a place of the page. @param {{clientX: number, clientY: number}} at */
  async add(at) {
    try {
      // Pictures in motion are too coarse for a read-out.
      this.#stage.still();
      this.#stage.draw();
      const { left, top, width, height } = this.#canvas.getBoundingClientRect();
      const [across, down] = [(at.clientX - left) / width, (at.clientY - top) / height];
      const hit = await this.#stage.renderer.pick(across * this.#canvas.width, down * this.#canvas.height);
      const { level } = this.#stage.renderer;
      if (hit) this.#stage.points = [...this.#stage.points, { ...hit, level }];
      this.#then.say(this.#said(hit));
      this.#then.pick(hit);
      this.place();
    } catch (error) {
      this.#then.fail(error);
    }
  }

  clear() {
    this.#stage.points = [];
    this.#then.say("");
    this.#then.pick(null);
    this.place();
  }

  /** Draws the marks where the last picture has their points. */
  place() {
    const { last } = this.#stage.renderer.inside ?? {};
    if (!last) return;
    const clipFromBox = invert(last.boxFromClip);
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const at = this.#stage.points.map((point) => {
      const [x, y] = moved(clipFromBox, point.box_mm);
      return [((x + 1) / 2) * width, ((1 - y) / 2) * height];
    });
    const made = at.flatMap(([cx, cy], i) => {
      const number = shape("text", { x: cx + 8, y: cy - 8, fill: "#ff0", "font-size": 13 });
      number.textContent = String(i + 1);
      return [shape("circle", { cx, cy, r: 5, fill: "none", stroke: "#ff0", "stroke-width": 2 }), number];
    });
    const line = { points: at.join(" "), fill: "none", stroke: "#ff0", "stroke-width": 2 };
    this.marks.replaceChildren(shape("polyline", line), ...made);
  }

  /** @param {Hit | null} hit */
  #said(hit) {
    if (!hit) return "Nothing is seen there.";
    const [before, last] = this.#stage.points.slice(-2);
    const read = words(last ?? before, this.#stage.renderer.segments);
    if (!last) return read;
    const { apart, uncertainty } = distance(before, last);
    return `${short(apart)} mm between the points, ± ${short(uncertainty)} mm; ${read}`;
  }
}

/** @param {string} name @param {Record<string, string | number>} attributes */
function shape(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  return made;
}
