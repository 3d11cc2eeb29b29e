/** Levels on the way to the one that is wanted, the coarsest first. */
import { choose } from "./drawing.js";
import { VolpkgError } from "./error.js";
import { passesOf } from "./shapes.js";

/** @typedef {import("./package.js").Package} Package */

/**
 * The files that a level of a picture needs, as far as the manifest says it.
 * @param {Package} pack @param {string} picture @param {number} level @param {number} frame
 */
export function filesOf(pack, picture, level, frame) {
  const { program, textures } = choose(pack, picture, level, frame);
  const shaders = [program, ...passesOf(program)].flatMap(({ vertex, fragment }) => [vertex, fragment]);
  return [...new Set([...shaders, ...textures.map(({ file }) => file)])];
}

/**
 * Draws level after level. Where this device draws one wrongly it takes the next: that may have another format.
 * @param {number[]} levels
 * @param {(index: number) => Promise<void>} swap draws a level from then on
 * @param {(index: number) => void} reached called after each level
 * @returns {Promise<Error | null>} why the last one could not be drawn
 */
export async function climb(levels, swap, reached) {
  /** @type {Error | null} */
  let failed = null;
  for (const index of levels) {
    try {
      await swap(index);
      failed = null;
    } catch (error) {
      if (!(error instanceof VolpkgError && error.code === "VP7014")) throw error;
      failed ??= error;
    }
    reached(index);
  }
  return failed;
}
