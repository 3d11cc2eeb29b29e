/** Slices across the patient's axes: values on a plane, and grey pictures of them over a window of values. */
import { invert, moved, worldFromBox } from "../camera.js";
import { VolpkgError } from "../core/messages.js";
import {
  drawValues,
  labelLine,
  labelOf,
  mediaOnGrids,
  mediumLines,
  segmentsOf,
  valueOf,
  valueProgram,
  windowOf,
} from "./values.js";

/** @typedef {import("../core/renderer.js").Renderer} Renderer */
/** @typedef {"axial" | "coronal" | "sagittal"} Plane */
/**
 * @typedef {object} SliceOptions
 * @property {Plane} [plane] axial if absent
 * @property {number} [at] from 0 to 1: from the feet to the head, from the front to the back, from right to left; the
 *   middle if absent
 * @property {number} [size] pixels along the longer side, 256 if absent
 * @property {number} [medium] which of several channels on grids of their own; the first if absent
 * @property {boolean} [labels] whether to read the labels of segments, for `outline`
 */
/**
 * @typedef {object} Slice
 * @property {number} width pixels
 * @property {number} height pixels
 * @property {Float32Array} values in the scan's unit, row by row from the top; NaN outside of the volume
 * @property {Uint16Array | null} labels of the voxels, row by row; null where none were asked for or drawn
 * @property {number} pixel_mm size of a pixel
 * @property {number} position_mm of the plane on its axis of the patient's space (LPS)
 * @property {number[]} corner_mm x, y, z of the upper left corner in the patient's space (LPS)
 * @property {number[]} range_mm positions of the plane at 0 and at 1
 */

/**
 * Axes of the patient's space to the right of the picture, down, and across it, with their signs. Pictures are as
 * radiologists see them: the patient's right is on the left, the front on top or on the left, the head on top.
 * @type {Record<Plane, readonly [right: readonly [number, number], down: readonly [number, number], across: number]>}
 */
export const PLANES = {
  axial: [[0, 1], [1, 1], 2],
  coronal: [[0, 1], [2, -1], 1],
  sagittal: [[1, 1], [2, -1], 0],
};
/** Names of the planes. */
export const PLANE_NAMES = /** @type {Plane[]} */ (Object.keys(PLANES));
const SIZE = 256;
const MOST_SIZE = 2048;
/** Along each side of a plane. */
const PLACES = 128;
const MAIN = `uniform vec3 u_slice_corner;
uniform vec3 u_slice_right;
uniform vec3 u_slice_down;
uniform vec3 u_slice_extent;
uniform vec2 u_slice_size;
void main() {
  vec2 at = gl_FragCoord.xy / u_slice_size;
  vec3 place = u_slice_corner + at.x * u_slice_right + at.y * u_slice_down;
  vec3 within = step(vec3(0.0), place) * step(place, u_slice_extent);
  float inside = within.x * within.y * within.z;
  vec3 here = clamp(place, vec3(0.0), u_slice_extent);
`;
const VALUE = `${MAIN}  float value = stored_value(position(here));
`;

/**
 * The values on a plane, at the level that is drawn.
 * @param {Renderer} renderer @param {SliceOptions} [options]
 * @returns {Promise<Slice | null>} null if the shaders of the package read no values: voxels are classified, or several
 *   channels on one grid are drawn
 */
export async function sliceOf(renderer, { plane = "axial", at = 0.5, size = SIZE, medium = 0, labels = false } = {}) {
  const axes = PLANES[plane];
  if (!axes || !(at >= 0 && at <= 1) || !(size >= 1 && size <= MOST_SIZE)) {
    const what = JSON.stringify({ plane, at, size });
    const reason = `planes are ${PLANE_NAMES.join(", ")}; at lies from 0 to 1, size from 1 to ${MOST_SIZE}`;
    throw new VolpkgError("VP7082", { what, reason });
  }
  const { transfer } = mediaOnGrids(renderer)[medium] ?? {};
  const linked = transfer
    ? await valueProgram(renderer, `slice ${medium}`, `${MAIN}${mediumLines(medium, "here")}`, `stored_value_${medium}`)
    : await valueProgram(renderer, "slice", VALUE);
  const isLabelled = labels && segmentsOf(renderer) !== null;
  const labelled = isLabelled
    ? await valueProgram(renderer, "slice labels", `${MAIN}${labelLine(renderer, "here")}`)
    : null;
  if (!linked || !renderer.inside) return null;
  const { corner, right, down, width, height, ...place } = placed(renderer.grid, axes, at, size);
  const draw = (/** @type {import("../gl/program.js").Linked} */ program) =>
    drawValues(renderer, program, [width, height], (gl, { locations }) => {
      const given = { corner, right, down, extent: [...renderer.grid.extent_mm_zyx].reverse() };
      for (const [name, value] of Object.entries(given))
        gl.uniform3fv(locations[`u_slice_${name}`], new Float32Array(value));
      gl.uniform2f(locations.u_slice_size, width, height);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    });
  const { bricks } = renderer.inside.drawn.choice;
  const places = () => ({ places: across(corner, right, down), mm: place.pixel_mm });
  const pixels = bricks ? await bricks.sharpened(() => draw(linked), places) : draw(linked);
  const marked = labelled && draw(labelled);
  const [low, high] = windowOf(renderer, transfer);
  const values = new Float32Array(width * height);
  for (let i = 0; i < values.length; i++) values[i] = pixels[4 * i + 3] ? low + valueOf(pixels, i) * (high - low) : NaN;
  const found = marked && Uint16Array.from(values, (_, i) => (marked[4 * i + 3] ? labelOf(marked, i) : 0));
  return { width, height, values, labels: found, ...place };
}

/** Places on a plane where bricks are wanted. @param {number[]} corner @param {number[]} right @param {number[]} down */
function across(corner, right, down) {
  const at = (/** @type {number} */ i) => (i + 0.5) / PLACES;
  return Array.from({ length: PLACES ** 2 }, (_, i) =>
    corner.map((each, axis) => each + at(i % PLACES) * right[axis] + at(Math.floor(i / PLACES)) * down[axis]),
  );
}

/**
 * Where a picture of a plane lies: its corner and its sides in box millimetres.
 * @param {import("../core/types.js").Grid} grid @param {(typeof PLANES)[Plane]} axes @param {number} at @param {number} size
 */
function placed(grid, [[x, signX], [y, signY], across], at, size) {
  const world = worldFromBox(grid);
  const box = invert(world);
  const [ez, ey, ex] = grid.extent_mm_zyx;
  const corners = Array.from({ length: 8 }, (_, i) => moved(world, [i & 1 ? ex : 0, i & 2 ? ey : 0, i & 4 ? ez : 0]));
  const low = [0, 1, 2].map((axis) => Math.min(...corners.map((corner) => corner[axis])));
  const high = [0, 1, 2].map((axis) => Math.max(...corners.map((corner) => corner[axis])));
  const pixel_mm = Math.max(high[x] - low[x], high[y] - low[y]) / size;
  const [width, height] = [x, y].map((axis) => Math.max(1, Math.round((high[axis] - low[axis]) / pixel_mm)));
  const position_mm = low[across] + at * (high[across] - low[across]);
  const begin = [0, 0, 0];
  begin[x] = signX > 0 ? low[x] : high[x];
  begin[y] = signY > 0 ? low[y] : high[y];
  begin[across] = position_mm;
  const corner = moved(box, begin);
  const side = (/** @type {number} */ axis, /** @type {number} */ length) => {
    const end = [...begin];
    end[axis] += length;
    return moved(box, end).map((each, i) => each - corner[i]);
  };
  const [right, down] = [side(x, signX * width * pixel_mm), side(y, signY * height * pixel_mm)];
  const range_mm = [low[across], high[across]];
  return { corner, right, down, width, height, pixel_mm, position_mm, corner_mm: begin, range_mm };
}

/**
 * A slice as grey pixels, red, green, blue, alpha: black at the lower end of the window, white at its upper end,
 * transparent outside of the volume.
 * @param {Slice} slice @param {{level: number, width: number}} window the value of middle grey, and the difference from
 *   black to white
 */
export function grey({ values }, { level, width }) {
  const pixels = new Uint8ClampedArray(4 * values.length);
  values.forEach((value, i) => {
    if (Number.isNaN(value)) return;
    pixels.fill(255 * ((value - level) / width + 0.5), 4 * i, 4 * i + 3);
    pixels[4 * i + 3] = 255;
  });
  return pixels;
}

/**
 * Draws the borders of visible segments into pixels of `grey`, in their colours; of segments that overlap, the first.
 * @param {Uint8ClampedArray<ArrayBuffer>} pixels @param {Slice} slice with labels @param {Renderer} renderer
 */
export function outline(pixels, { labels, width, height }, renderer) {
  const record = renderer.package.manifest.segments;
  if (!labels || !record) return pixels;
  const visible = renderer.segments.filter((segment) => segment.visible ?? true);
  const shown = record.labels.map(({ segments = [] }) => visible.find(({ name }) => segments.includes(name)));
  labels.forEach((label, i) => {
    const here = shown[label];
    if (!here) return;
    const [x, y] = [i % width, Math.floor(i / width)];
    const beside = [x > 0 && i - 1, x < width - 1 && i + 1, y > 0 && i - width, y < height - 1 && i + width];
    if (beside.every((at) => at === false || shown[labels[at]] === here)) return;
    const tint = here.tint ?? [1, 1, 1];
    pixels.set([...tint.map((value) => 255 * encodedOf(value)), 255], 4 * i);
  });
  return pixels;
}

/** sRGB of linear light. @param {number} light */
export const encodedOf = (light) => (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);
