/**
 * Finishes slow pictures while the camera of a canvas rests: each frame draws as much as its time allows, and a finished
 * picture is shown again. The parts of a finer level replace the picture of the coarser one, so that no frame is worse
 * than the frame before it.
 */
import { Finishing } from "./finish.js";

/** @typedef {import("../core/renderer.js").Renderer} Renderer */
/** @typedef {{boxFromClip: ArrayLike<number>, width: number, height: number}} View */

/** Default time of a frame. */
const FRAME_MS = 33;

/** Finishes the pictures of one renderer. */
export class Finisher {
  #renderer;
  /** The picture that is being finished; null if the last one was drawn at once. @type {Finishing | null} */
  #finishing = null;
  /** Contents of the last picture. */
  #shown = { view: "", program: "", level: -1, revision: -1 };
  /** The renderer's token of the last picture: another value if another picture was drawn meanwhile. @type {unknown} */
  #last = null;

  /** @param {Renderer} renderer */
  constructor(renderer) {
    this.#renderer = renderer;
  }

  /**
   * Draws a picture at once, or the next part of it.
   * @param {View} view @param {boolean} inTurns
   * @returns {boolean} whether more is to come
   */
  draw(view, inTurns) {
    const renderer = this.#renderer;
    if (inTurns) this.#step(view);
    else {
      this.#finishing = null;
      renderer.draw(view);
      this.#shown = this.#showing(view);
    }
    this.#last = renderer.moving ? null : renderer.inside?.last;
    return this.#finishing !== null;
  }

  /** @param {View} view */
  #step(view) {
    const { inside } = this.#renderer;
    if (!inside) return;
    const [before, now] = [this.#shown, this.#showing(view)];
    const isSameView = this.#last === inside.last && before.view === now.view && before.program === now.program;
    if (!isSameView || before.revision !== now.revision) {
      const over = isSameView && now.level < before.level;
      this.#finishing = new Finishing(this.#renderer, { ...view, budgetMs: inside.options.frameMs ?? FRAME_MS, over });
      this.#shown = now;
    }
    if (this.#finishing?.step() === 1) this.#finishing = null;
  }

  /** @param {View} view */
  #showing({ boxFromClip, width, height }) {
    const { program, level, revision } = this.#renderer;
    return { view: [...Array.from(boxFromClip), width, height].join(), program, level, revision };
  }
}
