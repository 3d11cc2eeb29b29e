/** A transfer function: its curve, and, where the package is editable, its points to be moved. */
import { make, svg } from "./dom.js";
import { mediaOf } from "./fusion.js";
import { Heights } from "./heights.js";
import { histogram } from "./histogram.js";
import { latest } from "./latest.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";
import { css, linear } from "./srgb.js";

const WIDTH = 340;
const HEIGHT = 130;
const LEFT = 6;
const RIGHT = 6;
const TOP = 8;
const BELOW = 32;
const NUDGE = 0.01;
/** Compositings that show where the value passes the function's isovalue. */
const SURFACES = ["first-hit", "isosurface"];

/** @typedef {{value: number, colour: [number, number, number], extinction_per_mm: number}} Point */

/**
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {any} manifest
 * @param {HTMLElement} place
 * @param {import("./files.js").Settings["opaque_lengths_mm"]} opaqueMm
 * @param {() => void} changed
 */
export function functionEditor(stage, manifest, place, opaqueMm, changed) {
  /** Points as they were changed, by the name of the function. @type {Map<string, Point[]>} */
  const edits = new Map();
  const editable = Boolean(manifest.editing);
  const apply = latest(async (/** @type {string} */ name) => {
    const points = edits.get(name);
    const transfer = points ? { points, reference_mm: of(manifest, name).reference_mm } : null;
    await stage.renderer.setTransfer(transfer, name).catch(showProblem);
  }, changed);
  const show = () => {
    const picture = stage.renderer.program;
    const { media } = manifest.pictures.find((/** @type {any} */ each) => each.name === picture);
    const names = media.map((/** @type {any} */ medium) => medium.transfer);
    if (isColour(manifest, picture)) {
      const most = of(manifest, names[3]).points.at(-1)?.extinction_per_mm ?? 0;
      const said = `Each voxel has its own colour. Its extinction is up to ${number(most)} per mm.`;
      place.replaceChildren(make("p", { className: "hint" }, said));
      return;
    }
    place.replaceChildren(
      ...names.map((/** @type {string} */ name, /** @type {number} */ i) => one(name, picture, !i)),
    );
  };
  /** @param {string} name @param {string} picture @param {boolean} isFirst */
  const one = (name, picture, isFirst) => {
    const { channel, points, isovalue } = of(manifest, name);
    const heights = new Heights(opaqueMm[name] ?? null);
    const box = make("div");
    const curve = new Curve(channel, edits.get(name) ?? points, heights, editable, (now) => {
      edits.set(name, now);
      undo.disabled = false;
      apply(name);
    });
    const undo = make("button", { type: "button", disabled: !edits.has(name) }, "Take changes back");
    undo.addEventListener("click", () => {
      edits.delete(name);
      apply(name);
      show();
    });
    if (name !== picture) box.append(make("h3", {}, name));
    if (isFirst) curve.count(stage).catch(showProblem);
    box.append(curve.element);
    const unit = channel.source.info.unit ? ` ${channel.source.info.unit}` : "";
    const { drawings } = manifest.pictures.find((/** @type {any} */ each) => each.name === picture);
    const { program } = drawings[0];
    const shows = manifest.programs.find((/** @type {any} */ each) => each.name === program)?.compositing;
    if (SURFACES.includes(shows)) {
      box.append(
        make("p", { className: "hint" }, `A surface is shown: where the value is ${number(isovalue)}${unit}.`),
      );
    }
    if (editable) {
      curve.buttons.append(undo);
      box.append(curve.fields, curve.buttons);
    } else if (!mediaOf(manifest, picture).length)
      box.append(
        make(
          "p",
          { className: "hint" },
          "To change it here, build the package from a scene with ",
          make("code", {}, "editable = true"),
          ".",
        ),
      );
    return box;
  };
  show();
  return {
    show,
    isEdited: () => edits.size > 0,
    takeBack: async () => {
      const kept = new Map(edits);
      for (const name of kept.keys()) await stage.renderer.setTransfer(null, name);
      return async () => {
        for (const [name, points] of kept)
          await stage.renderer.setTransfer({ points, reference_mm: of(manifest, name).reference_mm }, name);
      };
    },
  };
}

/** Whether a picture is that of a volume in colour. @param {any} manifest @param {string} picture */
export function isColour(manifest, picture) {
  return manifest.pictures.some((/** @type {any} */ each) => each.name === picture && each.mixing === "colour");
}

/** The function of a name, and its channel. @param {any} manifest @param {string} name */
function of(manifest, name) {
  for (const channel of manifest.channels) {
    const found = channel.transfer_functions.find((/** @type {any} */ each) => each.name === name);
    if (found)
      return {
        channel,
        points: /** @type {Point[]} */ (found.points),
        reference_mm: found.reference_mm,
        isovalue: found.isovalue,
      };
  }
  throw new Error(`there is no transfer function ${name}`);
}

/** Extinction, or opacity, over value; the area in the function's colours. */
class Curve {
  #points;
  #chosen = 0;
  #editable;
  #then;
  #unit;
  #low;
  #high;
  #most;
  #heights;
  /** How often values occur, from 0 to 1. @type {number[]} */
  #counts = [];
  element;
  fields = make("div", { className: "thirds" });
  buttons = make("div", { className: "row" });

  /**
   * @param {any} channel
   * @param {Point[]} points
   * @param {import("./heights.js").Heights} heights
   * @param {boolean} editable
   * @param {(points: Point[]) => void} then
   */
  constructor(channel, points, heights, editable, then) {
    this.#heights = heights;
    this.#points = points.map((point) => ({ ...point }));
    this.#editable = editable;
    this.#then = then;
    this.#unit = channel.source.info.unit || "";
    const window = channel.quantization?.window ?? [channel.statistics.minimum, channel.statistics.maximum];
    this.#low = Math.min(window[0], points[0].value);
    this.#high = Math.max(window[1], points[points.length - 1].value, this.#low + 1e-9);
    this.#most = Math.max(...points.map((point) => point.extinction_per_mm), 1e-9) * (editable ? 1.5 : 1.08);
    this.element = svg("svg", { class: "curve", viewBox: `0 0 ${WIDTH} ${HEIGHT}` });
    if (editable) this.#listen();
    else {
      this.element.setAttribute("role", "img");
      this.element.setAttribute(
        "aria-label",
        `${heights.name} from ${number(this.#low)} to ${number(this.#high)} ${this.#unit}`,
      );
    }
    this.#draw();
    this.#form();
  }

  /** Shows how often values occur, under the curve. @param {import("../runtime/stage.js").Stage} stage */
  async count({ renderer }) {
    await renderer.ready;
    this.#counts = (await histogram(renderer, [this.#low, this.#high])) ?? [];
    this.#draw();
  }

  /** @param {number} value */
  #x(value) {
    return LEFT + ((value - this.#low) / (this.#high - this.#low)) * (WIDTH - LEFT - RIGHT);
  }

  /** @param {number} extinction */
  #y(extinction) {
    const share = this.#heights.of(extinction) / this.#heights.of(this.#most);
    return TOP + (1 - Math.min(1, share)) * (HEIGHT - TOP - BELOW);
  }

  #draw() {
    const floor = this.#y(0);
    const points = this.#points;
    const ends = [{ ...points[0], value: this.#low }, ...points, { ...points[points.length - 1], value: this.#high }];
    const areas = ends.slice(1).flatMap((to, index) =>
      strips(ends[index], to, this.#heights.straight).map(([a, b]) =>
        svg("polygon", {
          points: `${this.#x(a.value)},${floor} ${this.#x(a.value)},${this.#y(a.extinction_per_mm)} ${this.#x(b.value)},${this.#y(b.extinction_per_mm)} ${this.#x(b.value)},${floor}`,
          fill: css(a.colour),
          "shape-rendering": "crispEdges",
        }),
      ),
    );
    const line = svg("polyline", {
      class: "line",
      points: [ends[0], ...ends.slice(1).flatMap((to, index) => bends(ends[index], to, this.#heights.straight))]
        .map((each) => `${this.#x(each.value)},${this.#y(each.extinction_per_mm)}`)
        .join(" "),
    });
    const corners = this.#counts.flatMap((share, i) =>
      [i, i + 1].map((end) => {
        const x = LEFT + (end / this.#counts.length) * (WIDTH - LEFT - RIGHT);
        return `${x},${floor - share * (floor - TOP)}`;
      }),
    );
    const outline = `${LEFT},${floor} ${corners.join(" ")} ${WIDTH - RIGHT},${floor}`;
    const told = svg("title", {}, "How often each value occurs, logarithmic");
    const counted = corners.length ? [svg("polygon", { class: "counts", points: outline }, told)] : [];
    const label = (/** @type {number} */ value, /** @type {string} */ anchor) =>
      svg("text", { x: this.#x(value), y: HEIGHT - 16, "text-anchor": anchor }, number(value));
    const title = svg(
      "text",
      { x: WIDTH / 2, y: HEIGHT - 3, "text-anchor": "middle" },
      `value${this.#unit ? ` in ${this.#unit}` : ""}; ${this.#heights.label(this.#most)}`,
    );
    const focused = document.activeElement?.parentNode === this.element;
    const handles = this.#editable ? points.map((point, index) => this.#handle(point, index)) : [];
    // Fingers are wider than their targets.
    const reach = handles.map((each, index) =>
      svg("circle", {
        class: "reach",
        cx: each.getAttribute("cx"),
        cy: each.getAttribute("cy"),
        r: 18,
        "data-index": index,
      }),
    );
    this.element.replaceChildren(
      svg("line", { class: "axis", x1: LEFT, x2: WIDTH - RIGHT, y1: floor, y2: floor }),
      ...areas,
      ...counted,
      line,
      label(this.#low, "start"),
      label(this.#high, "end"),
      title,
      ...reach,
      ...handles,
    );
    if (focused) handles[this.#chosen]?.focus();
  }

  /** @param {Point} point @param {number} index */
  #handle(point, index) {
    const text = `${number(point.value)} ${this.#unit}, ${this.#heights.text(point.extinction_per_mm)}`;
    return svg("circle", {
      class: index === this.#chosen ? "handle chosen" : "handle",
      cx: this.#x(point.value),
      cy: this.#y(point.extinction_per_mm),
      r: 7,
      tabindex: 0,
      role: "slider",
      "aria-label": `Point ${index + 1} of ${this.#points.length}`,
      "aria-valuetext": text,
      "aria-valuenow": point.value,
      "aria-valuemin": this.#low,
      "aria-valuemax": this.#high,
      "data-index": index,
    });
  }

  #listen() {
    let dragged = -1;
    const indexOf = (/** @type {Event} */ event) =>
      Number(/** @type {Element} */ (event.target).getAttribute?.("data-index") ?? -1);
    this.element.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
      dragged = /** @type {Element} */ (event.target).hasAttribute("data-index") ? indexOf(event) : -1;
      if (dragged < 0) return;
      this.element.setPointerCapture(event.pointerId);
      this.#choose(dragged);
    });
    this.element.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
      if (dragged < 0) return;
      const box = this.element.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width) * WIDTH;
      const y = ((event.clientY - box.top) / box.height) * HEIGHT;
      const value = this.#low + ((x - LEFT) / (WIDTH - LEFT - RIGHT)) * (this.#high - this.#low);
      const height = (1 - (y - TOP) / (HEIGHT - TOP - BELOW)) * this.#heights.of(this.#most);
      this.#change({ value, extinction_per_mm: this.#heights.extinction(height) });
    });
    for (const end of ["pointerup", "pointercancel"]) this.element.addEventListener(end, () => (dragged = -1));
    this.element.addEventListener("focusin", (/** @type {FocusEvent} */ event) => {
      const index = indexOf(event);
      if (index >= 0 && index !== this.#chosen) this.#choose(index);
    });
    this.element.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
      const moves = /** @type {Record<string, [number, number]>} */ ({
        ArrowLeft: [-1, 0],
        ArrowRight: [1, 0],
        ArrowUp: [0, 1],
        ArrowDown: [0, -1],
      });
      const move = moves[event.key];
      if (!move) return;
      event.preventDefault();
      const point = this.#points[this.#chosen];
      this.#change({
        value: point.value + move[0] * NUDGE * (this.#high - this.#low),
        extinction_per_mm: this.#heights.extinction(
          this.#heights.of(point.extinction_per_mm) + move[1] * NUDGE * this.#heights.of(this.#most),
        ),
      });
    });
  }

  /** @param {number} index */
  #choose(index) {
    this.#chosen = index;
    this.#draw();
    this.#form();
  }

  /** Changes the chosen point, between its neighbours. @param {Partial<Point>} wish */
  #change(wish) {
    const points = this.#points;
    const point = points[this.#chosen];
    Object.assign(point, wish);
    point.value = clamp(
      point.value,
      points[this.#chosen - 1]?.value ?? this.#low,
      points[this.#chosen + 1]?.value ?? this.#high,
    );
    point.extinction_per_mm = clamp(point.extinction_per_mm, 0, this.#most);
    this.#draw();
    this.#form();
    this.#then(points.map((point) => ({ ...point })));
  }

  /** The chosen point as fields, for exact numbers and for who does not drag. */
  #form() {
    if (!this.#editable || this.fields.contains(document.activeElement)) return;
    const point = this.#points[this.#chosen];
    const field = (
      /** @type {string} */ text,
      /** @type {any} */ properties,
      /** @type {(value: string) => Partial<Point> | null} */ read,
    ) => {
      const input = make("input", properties);
      input.addEventListener("change", () => {
        const wish = read(input.value);
        if (wish) this.#change(wish);
      });
      return make("label", {}, text, input);
    };
    const finite = (/** @type {string} */ text, /** @type {(value: number) => Partial<Point>} */ wish) =>
      text !== "" && Number.isFinite(Number(text)) ? wish(Number(text)) : null;
    this.fields.replaceChildren(
      field(
        `Point ${this.#chosen + 1}: value`,
        { type: "number", step: "any", value: Number(point.value.toPrecision(5)) },
        (text) => finite(text, (value) => ({ value })),
      ),
      field(
        this.#heights.name,
        {
          type: "number",
          step: "any",
          min: 0,
          value: Number(this.#heights.of(point.extinction_per_mm).toPrecision(4)),
        },
        (text) => finite(text, (height) => ({ extinction_per_mm: this.#heights.extinction(height) })),
      ),
      field("Colour", { type: "color", value: css(point.colour) }, (text) => ({ colour: linear(text) })),
    );
    const add = make("button", { type: "button" }, "Add a point");
    add.addEventListener("click", () => this.#add());
    const remove = make("button", { type: "button", disabled: this.#points.length < 3 }, "Remove it");
    remove.addEventListener("click", () => this.#remove());
    const kept = [...this.buttons.children].slice(2);
    this.buttons.replaceChildren(add, remove, ...kept);
  }

  /** Adds a point behind the chosen one, on the curve. */
  #add() {
    const points = this.#points;
    const at = Math.min(this.#chosen, points.length - 2);
    points.splice(at + 1, 0, between(points[at], points[at + 1], 0.5));
    this.#chosen = at + 1;
    this.#change({});
  }

  #remove() {
    this.#points.splice(this.#chosen, 1);
    this.#chosen = Math.min(this.#chosen, this.#points.length - 1);
    this.#change({});
  }
}

/** @param {number} value @param {number} least @param {number} most */
const clamp = (value, least, most) => Math.min(most, Math.max(least, value));

/** @param {Point} a @param {Point} b @param {number} share @returns {Point} */
function between(a, b, share) {
  const mix = (/** @type {number} */ p, /** @type {number} */ q) => p + (q - p) * share;
  return {
    value: mix(a.value, b.value),
    extinction_per_mm: mix(a.extinction_per_mm, b.extinction_per_mm),
    colour: [mix(a.colour[0], b.colour[0]), mix(a.colour[1], b.colour[1]), mix(a.colour[2], b.colour[2])],
  };
}

/** Points after the first that draw a line. @param {Point} a @param {Point} b @param {boolean} straight */
function bends(a, b, straight) {
  const count = straight || a.extinction_per_mm === b.extinction_per_mm ? 1 : 16;
  return Array.from({ length: count }, (_, index) => between(a, b, (index + 1) / count));
}

/** Pieces of a line that have one colour each. @param {Point} a @param {Point} b @param {boolean} straight */
function strips(a, b, straight) {
  const count = straight && a.colour.every((each, index) => each === b.colour[index]) ? 1 : 16;
  return Array.from({ length: count }, (_, index) => [
    between(a, b, index / count),
    between(a, b, (index + 1) / count),
  ]);
}
