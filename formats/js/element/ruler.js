/** Read-out at the pointer, and the distance between two points, drawn over a canvas. */
import { invert, moved } from "../camera.js";

/** @typedef {import("../draw/pick.js").Hit} Hit */
/** @typedef {import("./stage.js").Stage} Stage */

const SVG = "http://www.w3.org/2000/svg";
/** A pointer that has moved further than this has turned the volume. */
const CLICK_PX = 4;

/** @param {number} value */
const short = (value) => Number(value.toPrecision(4)).toString();

/** A hit as one line of text. @param {Hit} hit @param {{name: string, title?: string}[]} all segments of the package */
export function words({ value, segments, position_mm: at, voxel, uncertainty_mm: half }, all) {
  const place = at.map((each) => each.toFixed(1)).join(", ");
  const cell = voxel.map((each) => Math.round(each)).join(", ");
  const titles = segments?.map((name) => all.find((each) => each.name === name)?.title ?? name) ?? [];
  const named = titles.length ? `${titles.join(" and ")}: ` : "";
  return `${named}${value === null ? "" : `value ${short(value)}, `}${place} mm, voxel ${cell}, depth ± ${short(half)} mm`;
}

/** Distance between two hits, and how wrong it may be, in millimetres. @param {Hit} one @param {Hit} other */
export function distance(one, other) {
  const apart = Math.hypot(...one.position_mm.map((each, i) => each - other.position_mm[i]));
  return { apart, uncertainty: one.uncertainty_mm + other.uncertainty_mm };
}

/** Points on the visible volume: a click sets one, and the line between the last two has their distance. */
export class Ruler {
  #canvas;
  #stage;
  #then;
  /** @type {Hit[]} */
  #points = [];
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
      if (hit) this.#points = [...this.#points.slice(-1), hit];
      this.#then.say(this.#said(hit));
      this.#then.pick(hit);
      this.place();
    } catch (error) {
      this.#then.fail(error);
    }
  }

  clear() {
    this.#points = [];
    this.#then.say("");
    this.place();
  }

  /** Draws the marks where the last picture has their points. */
  place() {
    const { last } = this.#stage.renderer.inside ?? {};
    if (!last) return;
    const clipFromBox = invert(last.boxFromClip);
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const at = this.#points.map((each) => {
      const [x, y] = moved(clipFromBox, each.box_mm);
      return [((x + 1) / 2) * width, ((1 - y) / 2) * height];
    });
    const made = at.map(([cx, cy]) =>
      shape("circle", { cx, cy, r: 5, fill: "none", stroke: "#ff0", "stroke-width": 2 }),
    );
    if (at.length === 2) {
      const [[x1, y1], [x2, y2]] = at;
      made.unshift(shape("line", { x1, y1, x2, y2, stroke: "#ff0", "stroke-width": 2 }));
    }
    this.marks.replaceChildren(...made);
  }

  /** @param {Hit | null} hit */
  #said(hit) {
    if (!hit) return "Nothing is seen there.";
    const read = words(hit, this.#stage.renderer.segments);
    if (this.#points.length < 2) return read;
    const { apart, uncertainty } = distance(this.#points[0], this.#points[1]);
    return `${short(apart)} mm between the points, ± ${short(uncertainty)} mm; ${read}`;
  }
}

/** @param {string} name @param {Record<string, string | number>} attributes */
function shape(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  return made;
}
