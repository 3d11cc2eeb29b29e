/** Cutting: a box along the axes of the volume, and a plane that faces the viewer. */
import { byId, make } from "./dom.js";
import { latest } from "./latest.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";

const STEPS = 200;
/** Axes of the patient's space across the slices, and the side that stays: lower, back, right. @type {Record<string, [number, number]>} */
const SLICES = { axial: [2, -1], coronal: [1, 1], sagittal: [0, -1] };
/** A share of the way along a normal with this sign, from that along the axis, and back. @param {number} sign @param {number} share */
const along = (sign, share) => (sign > 0 ? share : 1 - share);

/** Direction of view in box space, where the plane stands, 0 in front of everything, and the slice that it is. @typedef {{normal: number[], share: number, slice?: string}} Plane */

/**
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {any} manifest
 * @param {() => void} changed
 * @param {(plane: string, share: number) => void} put moves a slice
 */
export function cutControls(stage, manifest, changed, put) {
  const extent = [...manifest.grid.extent_mm_zyx].reverse();
  const box = [[...extent].fill(0), [...extent]];
  /** @type {Plane | null} */
  let plane = null;
  const isCut = () =>
    plane !== null || box[0].some((value) => value > 0) || box[1].some((each, axis) => each < extent[axis]);
  const clip = () =>
    isCut()
      ? {
          box: /** @type {[number[], number[]]} */ ([box[0], box[1]]),
          planes: plane ? [coefficients(plane, extent)] : [],
        }
      : null;
  const cut = latest(() => stage.renderer.setClip(clip()).catch(showProblem), changed);
  const apply = () => {
    byId("cut-reset").disabled = !isCut();
    return cut();
  };
  const sliders = axisNames(manifest.grid).map((name, axis) => axisField(name, axis, box, extent, apply));
  byId("cut-box").replaceChildren(...sliders.map((slider) => slider.element));

  const depth = make("input", { type: "range", max: STEPS, value: STEPS / 2, disabled: true });
  const facing = make("button", { type: "button" }, "facing you");
  /** Cuts by a plane, or by none. @param {Plane | null} wanted */
  const cutBy = (wanted) => {
    plane = wanted;
    depth.disabled = !plane;
    depth.value = String(STEPS * (plane?.share ?? 0.5));
    for (const [name, button] of atSlices) button.setAttribute("aria-pressed", String(plane?.slice === name));
    return apply();
  };
  facing.addEventListener("click", () => cutBy({ normal: viewDirection(stage), share: 0.5 }));
  /** Where the slices are. @type {Record<string, number>} */
  const shares = {};
  const atSlices = Object.entries(SLICES).map(([name, [axis, sign]]) => {
    const button = make("button", { type: "button", "aria-pressed": "false" }, name);
    const normal = manifest.grid.direction[axis].map((/** @type {number} */ value) => sign * value);
    button.addEventListener("click", () =>
      cutBy(plane?.slice === name ? null : { normal, share: along(sign, shares[name] ?? 0.5), slice: name }),
    );
    return /** @type {const} */ ([name, button]);
  });
  depth.addEventListener("input", () => {
    if (plane) plane = { ...plane, share: Number(depth.value) / STEPS };
    if (plane?.slice) put(plane.slice, along(SLICES[plane.slice][1], plane.share));
    apply();
  });
  byId("cut-plane").replaceChildren(
    make(
      "fieldset",
      {},
      make("legend", {}, "Plane"),
      make("p", { className: "hint" }, "It faces you as you look now, or is a slice and moves with it."),
      make("div", { className: "row" }, facing, ...atSlices.map(([, button]) => button)),
      make("label", { className: "pair" }, "depth", depth, make("span")),
    ),
  );
  byId("cut-reset").addEventListener("click", () => {
    box[0].fill(0);
    extent.forEach((each, axis) => (box[1][axis] = each));
    for (const slider of sliders) slider.show();
    cutBy(null);
  });
  return {
    isCut,
    /** Keeps the cut at a slice that has moved. @param {string} slice @param {number} share */
    follow: (slice, share) => {
      shares[slice] = share;
      const next = SLICES[slice] && along(SLICES[slice][1], share);
      if (plane?.slice === slice && Math.abs(plane.share - next) > 1e-6) cutBy({ ...plane, share: next });
    },
    state: () => (isCut() ? { box, plane } : null),
    /** Cuts as a link says. @param {any} state */
    show: async (state) => {
      if (!state) return;
      box.forEach((corner, end) => corner.forEach((_, axis) => (corner[axis] = Number(state.box[end][axis]))));
      for (const slider of sliders) slider.show();
      await cutBy(state.plane);
    },
    takeBack: async () => {
      const kept = clip();
      await stage.renderer.setClip(null);
      return () => stage.renderer.setClip(kept);
    },
  };
}

/** @param {string} name @param {number} axis @param {number[][]} box @param {number[]} extent @param {() => void} apply */
function axisField(name, axis, box, extent, apply) {
  const outputs = [make("output"), make("output")];
  const inputs = [0, 1].map((end) =>
    make("input", { type: "range", min: 0, max: STEPS, "aria-label": `${name}: ${end ? "to" : "from"}` }),
  );
  const show = () => {
    for (const end of [0, 1]) {
      inputs[end].value = String(Math.round((box[end][axis] / extent[axis]) * STEPS));
      const text = `${number(box[end][axis])} mm`;
      outputs[end].value = text;
      inputs[end].setAttribute("aria-valuetext", text);
    }
  };
  inputs.forEach((input, end) => {
    input.addEventListener("input", () => {
      // A box keeps a slice at least.
      const least = extent[axis] / STEPS;
      const wish = (Number(input.value) / STEPS) * extent[axis];
      box[end][axis] = end ? Math.max(wish, box[0][axis] + least) : Math.min(wish, box[1][axis] - least);
      show();
      apply();
    });
  });
  show();
  const rows = [0, 1].map((end) =>
    make("label", { className: "pair" }, end ? "to" : "from", inputs[end], outputs[end]),
  );
  return { element: make("fieldset", {}, make("legend", {}, name), ...rows), show };
}

/** Names of the axes of the box: the nearest directions of the patient. @param {any} grid */
function axisNames(grid) {
  const ways = [
    ["right", "left"],
    ["front", "back"],
    ["feet", "head"],
  ];
  return [0, 1, 2].map((axis) => {
    const column = grid.direction.map((/** @type {number[]} */ row) => row[axis]);
    const main = column.reduce(
      (/** @type {number} */ best, /** @type {number} */ each, /** @type {number} */ index) =>
        Math.abs(each) > Math.abs(column[best]) ? index : best,
      0,
    );
    const [from, to] = column[main] > 0 ? ways[main] : [...ways[main]].reverse();
    return `${from[0].toUpperCase()}${from.slice(1)} to ${to}`;
  });
}

/** Direction in which the viewer looks, in box space. @param {any} stage */
function viewDirection({ orbit, renderer }) {
  const m = orbit.boxFromClip(1, renderer.grid);
  const at = (/** @type {number} */ z) => [0, 1, 2].map((row) => (m[8 + row] * z + m[12 + row]) / (m[11] * z + m[15]));
  const [near, far] = [at(-1), at(1)];
  const along = far.map((each, axis) => each - near[axis]);
  const length = Math.hypot(...along);
  return along.map((value) => value / length);
}

/** The plane as a·x + b·y + c·z + d > 0 where the volume is shown. @param {{normal: number[], share: number}} plane @param {number[]} extent */
function coefficients({ normal, share }, extent) {
  const corners = Array.from({ length: 8 }, (_, corner) =>
    normal.reduce((sum, each, axis) => sum + each * (corner & (1 << axis) ? extent[axis] : 0), 0),
  );
  const [least, most] = [Math.min(...corners), Math.max(...corners)];
  return [...normal, -(least + share * (most - least))];
}
