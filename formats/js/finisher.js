/**
 * Slow pictures of a canvas whose camera rests: each frame draws what it has time for, and a picture that is finished
 * is only shown again. Where a finer level has come, its parts replace the picture of the coarser one, so that no frame
 * is worse than the one before it.
 */
import { Finishing } from "./finish.js";

/** @typedef {import("./renderer.js").Renderer} Renderer */
/** @typedef {{boxFromClip: ArrayLike<number>, width: number, height: number}} View */

/** Unless the app says so. */
const FRAME_MS = 33;

/** Finishes the pictures of one renderer. */
export class Finisher {
  #renderer;
  /** The picture that is being finished; null if the last one was drawn at once. @type {Finishing | null} */
  #finishing = null;
  /** What the last picture shows. */
  #shown = { view: "", program: "", level: -1, revision: -1 };
  /** What the renderer says of the last picture: something else if another one was drawn meanwhile. @type {unknown} */
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
