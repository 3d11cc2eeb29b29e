/** The view from a light with a place, for shadow maps and half-angle slices. spec/light.md. */
import { cross, dot, multiply, unit } from "../camera.js";

/** @typedef {readonly number[]} Vector */

/** Width of the view relative to the volume, more than 1 so that the view contains the border. */
const WIDER = 1.01;

/** @param {Vector} a @param {Vector} b */
const minus = (a, b) => a.map((each, i) => each - b[i]);

/**
 * From box space to clip coordinates of the perspective that looks at the place of the volume nearest to the light, and
 * just holds the volume; null for a light in the volume.
 * @param {Vector} light @param {Vector} extent both x, y, z, box millimetres
 * @returns {number[] | null} column by column
 */
export function lightFromBox(light, extent) {
  const nearest = light.map((at, axis) => Math.min(Math.max(at, 0), extent[axis]));
  const distance = Math.hypot(...minus(nearest, light));
  if (!(distance > 1e-6 * Math.hypot(...extent))) return null;
  const ahead = minus(nearest, light).map((x) => x / distance);
  const least = [0, 1, 2].reduce((best, axis) => (Math.abs(ahead[axis]) < Math.abs(ahead[best]) ? axis : best), 0);
  const right = unit(
    cross(
      ahead,
      [0, 1, 2].map((axis) => Number(axis === least)),
    ),
  );
  const rows = [right, cross(right, ahead), ahead];
  const corners = Array.from({ length: 8 }, (_, i) =>
    rows.map((row) =>
      dot(
        row,
        minus(
          extent.map((size, axis) => ((i >> axis) & 1) * size),
          light,
        ),
      ),
    ),
  );
  const [x, y] = [0, 1]
    .map((axis) => corners.map((corner) => corner[axis] / corner[2]))
    .map((all) => ({ low: Math.min(...all), high: Math.max(...all) }));
  const [near, far] = [distance / WIDER, Math.max(...corners.map((corner) => corner[2])) * WIDER];
  const [wide, high] = [x, y].map((each) => 2 / ((each.high - each.low) * WIDER));
  const projection = [
    [wide, 0, 0, 0],
    [0, high, 0, 0],
    [(-wide * (x.high + x.low)) / 2, (-high * (y.high + y.low)) / 2, (far + near) / (far - near), 1],
    [0, 0, (-2 * far * near) / (far - near), 0],
  ];
  const moved = [
    ...[0, 1, 2].flatMap((axis) => [...rows.map((row) => row[axis]), 0]),
    ...rows.map((row) => -dot(row, light)),
    1,
  ];
  return multiply(projection.flat(), moved);
}
