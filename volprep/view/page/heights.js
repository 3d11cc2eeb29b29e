/**
 * The height of a transfer function: extinction, or the opacity of a pixel where the picture shows one value of a ray.
 */
import { number } from "./numbers.js";

/** Compositings whose pixels have the extinction of all samples; others show one value, with its own opacity. */
const OF_ALL_SAMPLES = ["emission-absorption", "back-to-front", "mida"];

/** Heights of one transfer function. */
export class Heights {
  #reference;

  /** @param {number | null} referenceMm length that has the opacity of a pixel; null if heights are extinctions */
  constructor(referenceMm) {
    this.#reference = referenceMm;
    this.name = referenceMm === null ? "Extinction" : "Opacity";
  }

  /** @param {number} extinction */
  of(extinction) {
    return this.#reference === null ? extinction : -Math.expm1(-extinction * this.#reference);
  }

  /** @param {number} height */
  extinction(height) {
    return this.#reference === null ? height : -Math.log1p(-Math.min(height, 1 - 1e-9)) / this.#reference;
  }

  /** Whether a line between two points is straight. */
  get straight() {
    return this.#reference === null;
  }

  /** @param {number} extinction */
  text(extinction) {
    const height = number(this.of(extinction));
    return this.#reference === null ? `extinction ${height} per mm` : `opacity ${height}`;
  }

  /** What the height of a curve says. @param {number} most largest extinction */
  label(most) {
    const what = this.#reference === null ? "extinction per mm" : "opacity of the pixel";
    return `height: ${what}, up to ${number(this.of(most))}`;
  }
}

/** Heights of a function in the pictures of a package. @param {any} manifest @param {string} name @param {number} referenceMm */
export function heightsOf(manifest, name, referenceMm) {
  const joint = [manifest.together, manifest.segments].find((each) => each?.transfers.includes(name));
  const shows = (/** @type {any} */ each) => each.transfer === name || each.transfer === joint?.name;
  const drawn = manifest.programs.find(shows);
  return new Heights(!drawn || OF_ALL_SAMPLES.includes(drawn.compositing) ? null : referenceMm);
}
