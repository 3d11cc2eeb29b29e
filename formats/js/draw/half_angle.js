/** Half-angle slices: a stack of layers, each drawn for the viewer and then for the light. spec/passes.md. */
import { cross, dot, unit } from "../camera.js";
import { axesOf, cornersOf, times } from "./layers.js";

/** @typedef {readonly number[]} Vector */

/**
 * The stack of a view: from the light's side on, across the middle between the ways to the viewer and to the light.
 * @param {Vector} extent x, y, z, millimetres @param {Vector} boxFromClip
 * @param {Vector} light place, box millimetres @param {Vector} boxFromLight the light's own view
 * @param {number} step the viewer's ray in the middle has at most so many millimetres of a layer
 * @returns {{boxFromSlices: number[], count: number, behind: boolean, seen: number[][], lit: number[][]}} `behind` where
 *   the light comes from behind the volume; `seen` and `lit` corners of triangles of each layer, for viewer and light
 */
export function halfAngleLayers(extent, boxFromClip, light, boxFromLight, step) {
  const { ahead } = axesOf(boxFromClip);
  const toLight = unit(light.map((at, axis) => at - extent[axis] / 2));
  const behind = dot(toLight, ahead) > 0;
  const across = unit(ahead.map((each, axis) => (behind ? -each : each) - toLight[axis]));
  const least = [0, 1, 2].reduce((best, axis) => (Math.abs(across[axis]) < Math.abs(across[best]) ? axis : best), 0);
  const right = unit(
    cross(
      across,
      [0, 1, 2].map((axis) => Number(axis === least)),
    ),
  );
  const diagonal = Math.hypot(...extent);
  const axes = [right, cross(across, right), across].map((value) => times(value, diagonal / 2));
  const boxFromSlices = [...axes.flatMap((axis) => [...axis, 0]), ...times(extent, 0.5), 1];
  const count = Math.max(1, Math.ceil(diagonal / (step * Math.abs(dot(ahead, across))) - 1e-9));
  const [seen, lit] = [boxFromClip, boxFromLight].map((from) =>
    byLayer(cornersOf("view-slices", boxFromSlices, axes, count, from, true), count),
  );
  return { boxFromSlices, count, behind, seen, lit };
}

/** @param {number[]} corners four numbers each; the third one is the layer @param {number} count of layers */
function byLayer(corners, count) {
  const found = Array.from({ length: count }, () => /** @type {number[]} */ ([]));
  for (let at = 0; at < corners.length; at += 4) found[corners[at + 2]].push(...corners.slice(at, at + 4));
  return found;
}
