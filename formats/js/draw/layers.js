/** The stack of layers of a view: its position, and the corners of its squares. spec/passes.md. */
import { cross, dot, invert, unit } from "../camera.js";

/** @typedef {readonly number[]} Vector */

/** Extra width of a stack on each side of the volume, in layers, as in its vertex shader. */
const RIM = 6;
/** Distance of the eye for parallel rays, in half depths of the stack. */
const FAR = 1e6;
const SQUARE = [
  [-1, -1],
  [1, -1],
  [1, 1],
  [-1, -1],
  [1, 1],
  [-1, 1],
];

/** @param {Vector} a @param {number} by */
export const times = (a, by) => a.map((x) => x * by);

/** @param {Vector} m column by column @param {Vector} at four numbers */
const product = (m, at) =>
  [0, 1, 2, 3].map((row) => at.reduce((sum, each, column) => sum + each * m[4 * column + row], 0));

/** Right, up and ahead of the view, in box space. @param {Vector} boxFromClip */
export function axesOf(boxFromClip) {
  const place = (/** @type {Vector} */ at) => {
    const [x, y, z, w] = product(boxFromClip, at);
    return [x / w, y / w, z / w];
  };
  const near = place([0, 0, -1, 1]);
  const from = (/** @type {Vector} */ at) => place(at).map((each, i) => each - near[i]);
  const across = unit(from([1, 0, -1, 1]));
  const view = unit(cross(across, unit(from([0, 1, -1, 1]))));
  const ahead = times(view, Math.sign(dot(view, from([0, 0, 1, 1]))));
  return { across, up: cross(ahead, across), ahead };
}

/**
 * @param {"axis-slices" | "view-slices"} geometry @param {Vector} extent x, y, z, millimetres @param {Vector} boxFromClip
 * @param {number} step the ray in the middle has at most so many millimetres of a layer @param {boolean} frontToBack
 */
export function layers(geometry, extent, boxFromClip, step, frontToBack) {
  const { across, up, ahead } = axesOf(boxFromClip);
  let axes = [across, up, ahead].map((value) => times(value, Math.hypot(...extent) / 2));
  if (geometry === "axis-slices") {
    // Of the stacks along the axes of the volume that one whose slices face the viewer most.
    const facing = [0, 1, 2].reduce((best, axis) => (Math.abs(ahead[axis]) > Math.abs(ahead[best]) ? axis : best), 0);
    axes = [1, 2, 0].map((next) => {
      const axis = (facing + next) % 3;
      return [0, 1, 2].map((value) => (value === axis ? extent[axis] / 2 : 0));
    });
    axes[2] = times(axes[2], Math.sign(ahead[facing]));
  }
  const depth = 2 * Math.hypot(...axes[2]);
  const cosine = (Math.abs(dot(ahead, axes[2])) * 2) / depth;
  const count = Math.max(1, Math.ceil(depth / (step * cosine) - 1e-9));
  const boxFromSlices = [...axes.flatMap((axis) => [...axis, 0]), ...times(extent, 0.5), 1];
  return { boxFromSlices, count, corners: cornersOf(geometry, boxFromSlices, axes, count, boxFromClip, frontToBack) };
}

/**
 * Corners of triangles in order: x, y, the number of the layer, and which of its sides. A layer across the view is its
 * far side. Of one along an axis it is all faces that rays leave it through, because rays may leave it at the rim.
 * @param {string} geometry @param {Vector} boxFromSlices @param {Vector[]} axes @param {number} count @param {Vector} boxFromClip @param {boolean} frontToBack
 */
export function cornersOf(geometry, boxFromSlices, axes, count, boxFromClip, frontToBack) {
  // With parallel rays w is 0, and the rest is where they come from: as from a point far away.
  const [x, y, z, w] = product(invert(boxFromSlices), product(boxFromClip, [0, 0, -1, 0]));
  const length = Math.hypot(x, y, z);
  const eye = Math.abs(w) * FAR <= length ? times([x, y, z], FAR / length) : [x / w, y / w, z / w];
  const sides = (/** @type {number} */ n) => [(2 * n) / count - 1, (2 * n + 2) / count - 1];
  const distance = Array.from({ length: count }, (_, n) => Math.abs((2 * n + 1) / count - 1 - eye[2]));
  const order = [...distance.keys()].sort((a, b) => distance[a] - distance[b] || a - b);
  if (!frontToBack) order.reverse();
  const rim = 1 + ((2 * RIM) / count) * Math.hypot(...axes[2]);
  /** Faces across the stack's own x and y, by axis and side, that are left through. */
  const around = [0, 1].flatMap((axis) => {
    const edge = 1 + (rim - 1) / Math.hypot(...axes[axis]);
    return [0, 1].flatMap((side) =>
      geometry === "axis-slices" && edge > eye[axis] * (2 * side - 1) ? [[axis, side]] : [],
    );
  });
  /** @type {number[]} */
  const corners = [];
  for (const n of order) {
    for (const side of [0, 1]) {
      const sign = 2 * side - 1;
      if (sides(n)[side] * sign > eye[2] * sign) for (const [a, b] of SQUARE) corners.push(a, b, n, side);
    }
    for (const [axis, side] of around)
      for (const [a, b] of SQUARE) corners.push(axis ? a : 2 * side - 1, axis ? 2 * side - 1 : a, n, (b + 1) / 2);
  }
  return corners;
}
