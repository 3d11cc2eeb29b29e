/** Lights that apps may change: lights with a place, and light around the volume that was computed once. */
import { invert } from "../camera.js";
import { environmentOf, problemOf, sharesOf } from "./environment.js";
import { VolpkgError } from "../core/messages.js";
import { lightFromBox } from "./light_view.js";

/** @typedef {import("./environment.js").Environment} Environment */
/** @typedef {import("../core/types.js").Grid} Grid */
/** @typedef {import("../core/types.js").Program} Program */
/**
 * The place of a light, or the light around the volume; null for the package's own.
 * @typedef {readonly number[] | Environment | null} Light
 */

/** @param {Light} light @returns {light is readonly number[]} */
const isPlace = (light) => Array.isArray(light);

/** Throws unless the package has such a light. @param {import("../core/package.js").Package} pack @param {Light} light */
export function checkLight({ manifest }, light) {
  const refuse = (/** @type {string} */ problem) => new VolpkgError("VP7063", { problem });
  const lit = manifest.programs.filter((program) => program.light);
  const turns = manifest.textures.some((texture) => texture.light?.model.turnable);
  if (!lit.length && !turns) throw refuse("no program of the package is lit by a light that can be changed");
  if (light === null) return;
  if (!isPlace(light)) {
    const problem = turns ? problemOf(light) : "no program of the package is lit by light that can be turned";
    if (problem) throw refuse(problem);
    return;
  }
  if (!lit.length) throw refuse("no program of the package is lit by a light with a place");
  if (!(light.length === 3 && light.every(Number.isFinite)))
    throw refuse(`${JSON.stringify(light)} is no place of three numbers`);
  if (lit.some((value) => isSeenFrom(value) && !placeOf(manifest.grid, value, light).light_from_box))
    throw refuse(`${JSON.stringify(light)} is in the volume, but shadows need a view of it from the light`);
}

/**
 * Values of uniforms, by their source, of the lights of a drawing.
 * @param {Grid} grid @param {import("../core/drawing.js").Choice} choice
 * @param {{light: Light, edits: ReadonlyMap<string, unknown>}} changes
 * @returns {Record<string, number[]>}
 */
export function lightOf(grid, { picture, program, textures }, { light, edits }) {
  const [place, around] = isPlace(light) ? [light, null] : [null, light];
  const values = program.light ? placeOf(grid, program, place) : {};
  const model = textures.find((texture) => texture.light?.model.turnable)?.light?.model;
  if (!model) return values;
  // After an edit the texels hold a light of 1 from all sides.
  const environment = environmentOf(model, around, edits.has(picture));
  return { ...values, environment: sharesOf(environment) };
}

/** Whether shadows need a view from the light. @param {Program} program */
const isSeenFrom = ({ light }) => light?.shadows === "map" || light?.shadows === "half-angle";

/**
 * Values of uniforms, by their source: a light's place in box millimetres, and the view from it where shadows need one.
 * @param {Grid} grid @param {Program} program @param {readonly number[] | null} moved where it is in place of the program's own
 * @returns {Record<string, number[]>} no view for a light in the volume
 */
function placeOf({ direction, origin_mm_xyz: origin, spacing_mm_zyx: spacing, extent_mm_zyx: extent }, program, moved) {
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
