/** Lights with a place, which apps may move. */
import { invert } from "./camera.js";
import { VolpkgError } from "./rarer.js";
import { lightFromBox } from "./light_view.js";

/** @typedef {import("./types.js").Grid} Grid */
/** @typedef {import("./types.js").Program} Program */

/** Throws unless a light can be there. @param {import("./package.js").Package} pack @param {readonly number[] | null} place */
export function checkLight({ manifest }, place) {
  const refuse = (/** @type {string} */ problem) => new VolpkgError("VP7063", { problem });
  const lit = [...manifest.programs, ...(manifest.subvolumes?.programs ?? [])].filter(({ light }) => light);
  if (!lit.length) throw refuse("no program of the package is lit by a light with a place");
  if (place === null) return;
  if (!(place.length === 3 && place.every(Number.isFinite)))
    throw refuse(`${JSON.stringify(place)} is no place of three numbers`);
  if (lit.some((each) => isSeenFrom(each) && !lightOf(manifest.grid, each, place).light_from_box))
    throw refuse(`${JSON.stringify(place)} is in the volume, but shadows need a view of it from the light`);
}

/** Whether shadows need a view from the light. @param {Program} program */
const isSeenFrom = ({ light }) => light?.shadows === "map" || light?.shadows === "half-angle";

/**
 * Values of uniforms, by their source: a light's place in box millimetres, and the view from it where shadows need one.
 * @param {Grid} grid @param {Program} program @param {readonly number[] | null} moved where it is in place of the program's own
 * @returns {Record<string, number[]>} no view for a light in the volume
 */
export function lightOf(
  { direction, origin_mm_xyz: origin, spacing_mm_zyx: spacing, extent_mm_zyx: extent },
  program,
  moved,
) {
  const light_mm = [0, 1, 2].map(
    (axis) =>
      spacing[2 - axis] / 2 +
      (moved ?? program.light?.place_mm_xyz ?? origin).reduce(
        (sum, at, row) => sum + direction[row][axis] * (at - origin[row]),
        0,
      ),
  );
  const light_from_box = isSeenFrom(program) && lightFromBox(light_mm, [...extent].reverse());
  return light_from_box ? { light_mm, light_from_box, box_from_light: invert(light_from_box) } : { light_mm };
}
