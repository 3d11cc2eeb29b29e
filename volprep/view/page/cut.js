/** Cutting: a box along the axes of the volume, and a plane that faces the viewer. */
import { byId, make } from "./dom.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";

const STEPS = 200;

/** @param {import("../runtime/stage.js").Stage} stage @param {any} manifest @param {() => void} changed */
export function cutControls(stage, manifest, changed) {
  const extent = [...manifest.grid.extent_mm_zyx].reverse();
  const box = [[...extent].fill(0), [...extent]];
  /** Direction of view in box space, and where the plane stands, 0 in front of everything. @type {{normal: number[], share: number} | null} */
  let plane = null;
  const isCut = () =>
    plane !== null || box[0].some((each) => each > 0) || box[1].some((each, axis) => each < extent[axis]);
  const clip = () =>
    isCut()
      ? {
          box: /** @type {[number[], number[]]} */ ([box[0], box[1]]),
          planes: plane ? [coefficients(plane, extent)] : [],
        }
      : null;
  let waiting = false;
  let again = false;
  const apply = async () => {
    byId("cut-reset").disabled = !isCut();
    again = true;
    if (waiting) return;
    waiting = true;
    while (again) {
      again = false;
      await stage.renderer.setClip(clip()).catch(showProblem);
    }
    waiting = false;
    changed();
  };
  const sliders = axisNames(manifest.grid).map((name, axis) => axisField(name, axis, box, extent, apply));
  byId("cut-box").replaceChildren(...sliders.map((each) => each.element));

  const depth = make("input", {
    type: "range",
    min: 0,
    max: STEPS,
    value: STEPS / 2,
    disabled: true,
    "aria-label": "Depth of the plane",
  });
  const facing = make("button", { type: "button" }, "Cut towards you, from here");
  facing.addEventListener("click", () => {
    plane = { normal: viewDirection(stage), share: 0.5 };
    depth.disabled = false;
    depth.value = String(STEPS / 2);
    apply();
  });
  depth.addEventListener("input", () => {
    if (plane) plane = { ...plane, share: Number(depth.value) / STEPS };
    apply();
  });
  byId("cut-plane").replaceChildren(
    make(
      "fieldset",
      {},
      make("legend", {}, "Plane that faces you"),
      make("p", { className: "hint" }, "Turn the volume, then cut. The plane stays where it is when you turn on."),
      make("div", { className: "row" }, facing),
      make("label", { className: "pair" }, "depth", depth, make("span")),
    ),
  );
  byId("cut-reset").addEventListener("click", () => {
    plane = null;
    depth.disabled = true;
    box[0].fill(0);
    extent.forEach((each, axis) => (box[1][axis] = each));
    for (const each of sliders) each.show();
    apply();
  });
  return {
    isCut,
    state: () => (isCut() ? { box, plane } : null),
    /** Cuts as a link says. @param {any} state */
    show: async (state) => {
      if (!state) return;
      box.forEach((corner, end) => corner.forEach((_, axis) => (corner[axis] = Number(state.box[end][axis]))));
      plane = state.plane;
      depth.disabled = !plane;
      depth.value = String(STEPS * (state.plane?.share ?? 0.5));
      for (const each of sliders) each.show();
      await apply();
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
  return along.map((each) => each / length);
}

/** The plane as a·x + b·y + c·z + d > 0 where the volume is shown. @param {{normal: number[], share: number}} plane @param {number[]} extent */
function coefficients({ normal, share }, extent) {
  const corners = Array.from({ length: 8 }, (_, corner) =>
    normal.reduce((sum, each, axis) => sum + each * (corner & (1 << axis) ? extent[axis] : 0), 0),
  );
  const [least, most] = [Math.min(...corners), Math.max(...corners)];
  return [...normal, -(least + share * (most - least))];
}
