/** Lights with a place, which apps may move. */
import { VolpkgError } from "./rarer.js";

/** Throws unless a light can be there. @param {import("./package.js").Package} pack @param {readonly number[] | null} place */
export function checkLight({ manifest }, place) {
  const lit = [...manifest.programs, ...(manifest.subvolumes?.programs ?? [])].some(({ light }) => light);
  if (!lit) throw new VolpkgError("VP7063", { problem: "no program of the package is lit by a light with a place" });
  if (place !== null && !(place.length === 3 && place.every(Number.isFinite))) throw new VolpkgError("VP7063", { problem: `${JSON.stringify(place)} is no place of three numbers` });
}

/**
 * A light's place in box millimetres.
 * @param {import("./types.js").Grid} grid @param {import("./types.js").Program} program @param {readonly number[] | null} moved where it is in place of the program's own
 */
export function lightOf({ direction, origin_mm_xyz: origin, spacing_mm_zyx: spacing }, { light }, moved) {
  return [0, 1, 2].map((axis) => spacing[2 - axis] / 2 + (moved ?? light?.place_mm_xyz ?? origin).reduce((sum, at, row) => sum + direction[row][axis] * (at - origin[row]), 0));
}
