/** One of the linked slices: its picture with crosshair and outlines, and a slider for its place. */
import { PLANES, PLANE_NAMES, grey, outline } from "../runtime/slices.js";
import { field, make, slider } from "./dom.js";
import { fuse, veilsOf } from "./fusion.js";
import { latest } from "./latest.js";
import { number } from "./numbers.js";

const STEPS = 200;
export const MOST_ZOOM = 8;
/** Pixels along the longer side of a slice, and of one that is zoomed. */
const [SIZE, ZOOMED_SIZE] = [256, 512];
/** A pointer that has moved further than this changes the window, or has turned the volume. */
const CLICK_PX = 4;
/** The direction in which the position grows. @type {Record<string, string>} */
const ACROSS = { axial: "feet to head", coronal: "front to back", sagittal: "right to left" };
/** Letters at the left, right, upper and lower edge. @type {Record<string, string>} */
const LETTERS = { axial: "RLAP", coronal: "RLHF", sagittal: "APHF" };

/**
 * What the slices share: the place of the crosshair in the patient's space, null for the middle; what moves it; and what
 * zooms all slices around a place in the box of one.
 * @typedef {object} Shared
 * @property {import("../runtime/renderer.js").Renderer} renderer
 * @property {{now: () => {level: number, width: number}, drag: (x: number, y: number) => void}} window of values
 * @property {() => number[] | null} cross @property {(place: number[]) => void} go
 * @property {(zoom: number, plane: string, at: number[]) => void} zoomAll
 */

/**
 * Slices of the three planes with one crosshair and one zoom.
 * @param {Shared["renderer"]} renderer @param {Shared["window"]} window
 * @param {{shown?: (isThere: boolean) => void, zoomed?: (zoom: number) => void, failed: (error: unknown) => void}} told
 */
export function linkedSlices(renderer, window, { shown, zoomed, failed }) {
  /** @type {number[] | null} */
  let cross = null;
  const go = (/** @type {number[]} */ place) => {
    cross = place;
    read();
  };
  const zoomAll = (/** @type {number} */ wanted, plane = "", /** @type {number[]} */ at = []) => {
    const zoom = within(wanted, 1, MOST_ZOOM);
    for (const view of views) view.zoomTo(zoom, view.plane === plane ? at : null);
    zoomed?.(zoom);
    read();
  };
  const views = PLANE_NAMES.map((plane) => new SliceView(plane, { renderer, window, cross: () => cross, go, zoomAll }));
  const read = latest(async () => {
    let isThere = true;
    for (const view of views) isThere = Boolean(await view.read().catch(failed)) && isThere;
    shown?.(isThere);
    for (const view of views) view.paint();
  });
  return { views, go, read, zoomAll };
}

class SliceView {
  plane;
  box;
  field;
  #axes;
  #shared;
  #slider;
  #canvas = make("canvas", { role: "img", width: 1, height: 1 });
  #lines = ["across", "down"].map((name) => make("i", { className: name, "aria-hidden": "true" }));
  /** @type {import("../runtime/slices.js").Slice | null} */
  #slice = null;
  /** @type {import("./fusion.js").Veil[]} */
  #veils = [];
  #zoom = 1;
  /** Where the left upper corner of the zoomed picture is in its box. */
  #offset = [0, 0];

  /** @param {import("../runtime/slices.js").Plane} plane @param {Shared} shared */
  constructor(plane, shared) {
    this.plane = plane;
    this.#axes = PLANES[plane];
    this.#shared = shared;
    const letters = ["left", "right", "above", "below"].map((edge, i) =>
      make("span", { className: edge, "aria-hidden": "true" }, LETTERS[plane][i]),
    );
    this.box = make("div", { className: "slice" }, this.#canvas, ...this.#lines, ...letters);
    this.#slider = slider(`slice-${plane}`, 0, STEPS, STEPS / 2, 1);
    this.field = field(`${plane} slice`, this.#slider.input, this.#slider.output);
    this.#slider.input.addEventListener("input", () => this.#goAcross(this.share()));
    this.box.addEventListener("wheel", (/** @type {WheelEvent} */ event) => this.#wheel(event), { passive: false });
    onClick(this.box, (event) => this.#click(event));
    onDrag(this.box, shared.window.drag);
    new ResizeObserver(() => this.paint()).observe(this.#canvas);
  }

  /** Place of the slice, from 0 to 1. */
  share() {
    return Number(this.#slider.input.value) / STEPS;
  }

  /** Moves the slice, and the crosshair with it. @param {number} share */
  put(share) {
    const place = this.#shared.cross();
    if (!this.#slice || !place) this.#slider.input.value = String(share * STEPS);
    else {
      const [low, high] = this.#slice.range_mm;
      place[this.#axes[2]] = low + share * (high - low);
    }
  }

  /** Reads the values at the crosshair; false if there are none. */
  async read() {
    const place = this.#shared.cross();
    if (place && this.#slice) {
      const [low, high] = this.#slice.range_mm;
      this.#slider.input.value = String(STEPS * within((place[this.#axes[2]] - low) / (high - low), 0, 1));
    }
    const size = this.#zoom > 1 ? ZOOMED_SIZE : SIZE;
    const where = { plane: this.plane, at: this.share(), size };
    this.#slice = await this.#shared.renderer.slice({ ...where, labels: true });
    this.#veils = await veilsOf(this.#shared.renderer, where);
    return this.#slice !== null;
  }

  paint() {
    if (!this.#slice) return;
    const { width, height, position_mm } = this.#slice;
    Object.assign(this.#canvas, { width, height });
    const fused = fuse(grey(this.#slice, this.#shared.window.now()), this.#veils);
    const pixels = outline(fused, this.#slice, this.#shared.renderer);
    this.#canvas.getContext("2d").putImageData(new ImageData(pixels, width, height), 0, 0);
    const told = `${number(position_mm)} mm`;
    this.#slider.output.value = told;
    this.#slider.input.setAttribute("aria-valuetext", told);
    this.#canvas.setAttribute("aria-label", `The ${this.plane} slice at ${told}, ${ACROSS[this.plane]}.`);
    const [left, top] = this.#crossing(this.#slice).map((at, axis) => this.#zoom * at + this.#offset[axis]);
    this.#lines[0].style.top = `${top}px`;
    this.#lines[1].style.left = `${left}px`;
  }

  /** Zooms around a place of the box, or around the crosshair. @param {number} zoom @param {number[] | null} around */
  zoomTo(zoom, around) {
    if (!this.#slice) return;
    const fixed = around ?? this.#crossing(this.#slice).map((at, axis) => this.#zoom * at + this.#offset[axis]);
    const size = [this.#canvas.clientWidth, this.#canvas.clientHeight];
    this.#offset = fixed.map((at, axis) =>
      within(at - ((at - this.#offset[axis]) * zoom) / this.#zoom, size[axis] * (1 - zoom), 0),
    );
    this.#zoom = zoom;
    const [left, top] = this.#offset;
    this.#canvas.style.transform = `translate(${left}px, ${top}px) scale(${zoom})`;
    this.paint();
  }

  /** The place of the crosshair, or else the middle of the slice. @param {import("../runtime/slices.js").Slice} slice */
  #place({ corner_mm, pixel_mm, width, height, position_mm }) {
    const [[x, signX], [y, signY], across] = this.#axes;
    const middle = [...corner_mm];
    middle[x] += (signX * pixel_mm * width) / 2;
    middle[y] += (signY * pixel_mm * height) / 2;
    middle[across] = position_mm;
    return [...(this.#shared.cross() ?? middle)];
  }

  /** Where the crosshair is in the box, before the zoom. @param {import("../runtime/slices.js").Slice} slice */
  #crossing(slice) {
    const [[x, signX], [y, signY]] = this.#axes;
    const place = this.#place(slice);
    const { left, top, scale } = fitted(this.#canvas, slice);
    const pixels = (/** @type {number} */ axis) => (scale * (place[axis] - slice.corner_mm[axis])) / slice.pixel_mm;
    return [left + signX * pixels(x), top + signY * pixels(y)];
  }

  /** @param {number} share of the way across the slices */
  #goAcross(share) {
    if (!this.#slice) return;
    const place = this.#place(this.#slice);
    const [low, high] = this.#slice.range_mm;
    place[this.#axes[2]] = low + within(share, 0, 1) * (high - low);
    this.#shared.go(place);
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    if (event.ctrlKey) this.#shared.zoomAll(this.#zoom * 2 ** (-event.deltaY / 200), this.plane, this.#inBox(event));
    else this.#goAcross(this.share() + Math.sign(event.deltaY) / STEPS);
  }

  /** @param {PointerEvent} event */
  #click(event) {
    if (!this.#slice) return;
    const [[x, signX], [y, signY], across] = this.#axes;
    const { left, top, scale } = fitted(this.#canvas, this.#slice);
    const [right, below] = this.#inBox(event).map((at, axis) => (at - this.#offset[axis]) / this.#zoom);
    const { corner_mm, pixel_mm, position_mm } = this.#slice;
    const place = [...corner_mm];
    place[x] += (signX * pixel_mm * (right - left)) / scale;
    place[y] += (signY * pixel_mm * (below - top)) / scale;
    place[across] = position_mm;
    this.#shared.go(place);
  }

  /** Where a pointer is in the box. @param {MouseEvent} event */
  #inBox({ clientX, clientY }) {
    const { left, top } = this.box.getBoundingClientRect();
    return [clientX - left, clientY - top];
  }
}

/** @param {number} value @param {number} low @param {number} high */
const within = (value, low, high) => Math.min(high, Math.max(low, value));

/** Where `object-fit: contain` puts a picture. @param {HTMLElement} canvas @param {{width: number, height: number}} picture */
function fitted({ clientWidth, clientHeight }, { width, height }) {
  const scale = Math.min(clientWidth / width, clientHeight / height);
  return { scale, left: (clientWidth - scale * width) / 2, top: (clientHeight - scale * height) / 2 };
}

/** Calls for a press that does not move. @param {HTMLElement} element @param {(event: PointerEvent) => void} act */
export function onClick(element, act) {
  let down = { clientX: 0, clientY: 0 };
  element.addEventListener("pointerdown", (event) => (down = event));
  element.addEventListener("pointerup", (event) => {
    if (Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) <= CLICK_PX) act(event);
  });
}

/** Calls with the pixels that a pressed pointer moves. @param {HTMLElement} element @param {(x: number, y: number) => void} act */
function onDrag(element, act) {
  let far = 0;
  element.addEventListener("pointerdown", (event) => {
    far = 0;
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    far += Math.hypot(event.movementX, event.movementY);
    if (far > CLICK_PX) act(event.movementX, event.movementY);
  });
}
