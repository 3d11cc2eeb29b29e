/** How coarse a picture may be while the camera moves: as fine as its measured time allows. */
import { isWebGl2 } from "../gl/formats.js";

/** @typedef {import("../gl/formats.js").Gl} Gl */
/** @typedef {{step: number, scale: number}} Quality times the step, and the share of the pixels along an axis */

/** The finest first. A step costs less than it saves up to here; then pixels go. @type {Quality[]} */
const RUNGS = [
  { step: 1, scale: 1 },
  { step: 1.5, scale: 1 },
  { step: 2, scale: 0.8 },
  { step: 2, scale: 0.6 },
  { step: 3, scale: 0.5 },
  { step: 4, scale: 0.35 },
];
const FIRST = 2;
/** Of WebGL 1, where measuring waits for the GPU: one picture of so many is measured. */
const EVERY = 8;
const POLL_MS = 1;

/** @param {Quality} quality share of the samples of the finest */
const cost = ({ step, scale }) => (scale * scale) / step;

/** Times pictures by fences, or by reading a pixel in WebGL 1, and chooses the quality of the next picture. */
export class Pace {
  #gl;
  #budget;
  /** Milliseconds of a picture of full quality, as far as known. */
  #full = 0;
  #rung = FIRST;
  #count = 0;
  #start = 0;
  /** @type {WebGLSync | null} */
  #fence = null;

  /** @param {Gl} gl @param {number} budget milliseconds for a picture */
  constructor(gl, budget) {
    this.#gl = gl;
    this.#budget = budget;
  }

  get quality() {
    return RUNGS[this.#rung];
  }

  /** Whether a picture of full quality takes too long; undefined before the first one was measured. */
  get slow() {
    return this.#full ? this.#full > this.#budget : undefined;
  }

  /** @param {boolean} moving */
  before(moving) {
    if (!moving || isWebGl2(this.#gl)) {
      this.#start = performance.now();
      return;
    }
    if (this.#count++ % EVERY === 0) {
      this.#wait();
      this.#start = performance.now();
    } else this.#start = 0;
  }

  /** @param {boolean} moving */
  after(moving) {
    if (!moving || !this.#start) return;
    const gl = this.#gl;
    if (!isWebGl2(gl)) {
      this.#wait();
      this.took(performance.now() - this.#start, this.quality);
    } else if (!this.#fence) {
      this.#fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      this.#poll(this.#start, this.quality);
    }
  }

  /** A picture of this quality took so long. @param {number} ms @param {Quality} quality */
  took(ms, quality) {
    const full = ms / cost(quality);
    // Slower counts at once, faster slowly: a single fast picture is no reason to stutter.
    this.#full = full > this.#full ? full : this.#full * 0.8 + full * 0.2;
    const found = RUNGS.findIndex((rung) => this.#full * cost(rung) <= this.#budget);
    this.#rung = found < 0 ? RUNGS.length - 1 : found;
  }

  dispose() {
    if (this.#fence && isWebGl2(this.#gl)) this.#gl.deleteSync(this.#fence);
    this.#fence = null;
  }

  /** @param {number} start @param {Quality} quality */
  #poll(start, quality) {
    const gl = /** @type {WebGL2RenderingContext} */ (this.#gl);
    setTimeout(() => {
      if (!this.#fence) return;
      if (gl.isContextLost()) this.dispose();
      else if (gl.getSyncParameter(this.#fence, gl.SYNC_STATUS) === gl.SIGNALED) {
        this.dispose();
        this.took(performance.now() - start, quality);
      } else this.#poll(start, quality);
    }, POLL_MS);
  }

  #wait() {
    const gl = this.#gl;
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }
}
