/**
 * The height of a transfer function: extinction, or the opacity of a pixel where the picture shows one value of a ray.
 */
import { number } from "./numbers.js";

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

  /** Label of the heights of a curve. @param {number} most largest extinction */
  label(most) {
    const what = this.#reference === null ? "extinction per mm" : "opacity of the pixel";
    return `height: ${what}, up to ${number(this.of(most))}`;
  }
}
