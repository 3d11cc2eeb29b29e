/** Draws a package with WebGL 1 or 2. */
import { check } from "./abort.js";
import { checkContext } from "../gl/device.js";
import { VolpkgError } from "./error.js";
import { RendererState } from "./renderer_state.js";
import { paint } from "../draw/paint.js";

/** @typedef {import("../gl/formats.js").Gl} Gl */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("../draw/motion_quality.js").Quality} Quality */
/** @typedef {import("./options.js").Viewport} Viewport */
/** @typedef {import("./options.js").Depth} Depth */
/** @typedef {import("./options.js").How} How */
/** @typedef {import("./options.js").RendererOptions} RendererOptions */

/**
 * Draws one picture at one level. Get one from `createRenderer`. Its event "change" says that a new picture is worth
 * drawing: a finer level has come, or something was changed.
 */
export class Renderer extends RendererState {
  #gl;
  #options;
  #listeners = new AbortController();
  /**
   * Camera and size of the last own picture.
   * @type {{boxFromClip: number[], width: number, height: number, quality: Quality} | null}
   */
  #last = null;
  /** Once the camera has moved. @type {import("../draw/motion_quality.js").Pace | null} */
  #pace = null;
  #moving = false;

  /** @param {Gl} gl @param {Package} pack @param {RendererOptions} options */
  constructor(gl, pack, options) {
    super(gl, pack, options);
    this.#gl = gl;
    this.#options = options;
    const { signal } = this.#listeners;
    options.signal?.addEventListener("abort", () => this.dispose(), { signal });
    const canvas = /** @type {EventTarget} */ (gl.canvas);
    canvas.addEventListener(
      "webglcontextlost",
      (event) => {
        event.preventDefault();
        this.#end();
      },
      { signal },
    );
    canvas.addEventListener("webglcontextrestored", () => this.#restore(), { signal });
  }

  /** How pictures are drawn now: times the step, and the share of the pixels along an axis. */
  get quality() {
    return this.#quality(this.#moving);
  }

  /** Whether the camera moves. */
  get moving() {
    return this.#moving;
  }

  /** Whether a picture in full takes longer than `frameMs`, as measured; before, whether its technique is made for that. */
  get slow() {
    return this.#pace?.slow ?? /slabs|tiles/.test(this._levels.drawn?.choice.program.technique ?? "");
  }

  /** Starts loading; resolves when the coarsest available level can be drawn. Rejects if a signal ends it. */
  async start() {
    try {
      await this._levels.start();
      [this.package, this.#options].map(({ signal }) => check(signal));
    } catch (error) {
      this.dispose();
      throw error;
    }
    return this;
  }

  /** Sets whether the camera moves. While it moves, slow pictures are drawn coarser. @param {boolean} moving */
  interacting(moving) {
    if (this.#moving === moving) return;
    this.#moving = moving;
    this._changed();
  }

  /**
   * Draws a picture, premultiplied linear RGBA.
   * @param {How} how
   * @returns {boolean} false if there is nothing to draw with, because the context is lost, or no pixel to draw
   */
  draw({
    boxFromClip,
    viewport = this.#whole(),
    target,
    keep,
    depth,
    planes = [],
    blend = false,
    part,
    moving = this.#moving,
  }) {
    const { drawn, device } = this._levels;
    const [, , width, height] = viewport;
    if (!drawn || !device || !(width && height)) return false;
    if (planes.length || this._changes.more) this.#follow(planes, drawn.choice);
    if (moving && !this.#pace && this.#options.frameMs !== Infinity) this.#measure();
    const quality = this.#quality(moving);
    const light = drawn.lightOf?.(this.grid, drawn.choice, this._changes);
    const stepMm = Math.max(this.step * quality.step, this._least());
    this.use(() => {
      this.#pace?.before(moving);
      const mesh = this._changes.edits.size || drawn.clip ? null : drawn.mesh;
      paint(this.#gl, device, drawn, {
        boxFromClip,
        viewport,
        target,
        picture: device.pictures.of(keep),
        scale: quality.scale,
        // Where the picture is blended with another one, only one draw may make it.
        mesh: blend ? null : mesh,
        behind: { ...depth, planes },
        values: { ...drawn.choice.values, ...light, box_from_clip: Array.from(boxFromClip), step_mm: stepMm },
        blend,
        part,
      });
      this.#pace?.after(moving);
      if (target === undefined) this.#last = { boxFromClip: Array.from(boxFromClip), width, height, quality };
    });
    return true;
  }

  /**
   * Shows the own picture, encoded as sRGB.
   * @param {{viewport?: Viewport, background?: readonly number[], target?: WebGLFramebuffer | null}} [how] background:
   *   linear red, green, blue
   */
  present({ viewport = this.#whole(), background = [0, 0, 0], target = null } = {}) {
    const { device } = this._levels;
    const texture = this.texture;
    if (!device || !texture) return;
    this.use(() => {
      const gl = this.#gl;
      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      device.state(false);
      device.pictures.show(texture, viewport, background);
      device.unbind();
    });
  }

  /** The renderer's picture: premultiplied linear RGBA, row 0 on top. `format` is the format of its target. */
  readPixels() {
    const picture = this._levels.device?.pictures.of();
    if (!picture?.texture) throw new VolpkgError("VP7018", { problem: "no picture was drawn" });
    let pixels = /** @type {Float32Array} */ (new Float32Array(0));
    this.use(() => {
      pixels = picture.read();
      this.#gl.bindFramebuffer(this.#gl.FRAMEBUFFER, null);
    });
    return { width: picture.width, height: picture.height, format: picture.format, pixels };
  }

  /** Texture of the own picture, for apps that show it themselves. */
  get texture() {
    return this.textureOf();
  }

  /** Texture of the picture that is kept under a key. @param {object} [keep] */
  textureOf(keep) {
    return this._levels.device?.pictures.of(keep).texture ?? null;
  }

  /** Frees the picture that is kept under a key. @param {object} keep */
  forget(keep) {
    this.use(() => this._levels.device?.pictures.forget(keep));
  }

  /**
   * The first point of a ray where the accumulated opacity reaches `options.opacity`.
   * @param {number} x pixels of the last own picture from its left edge @param {number} y from its upper edge
   * @param {import("../draw/pick.js").PickOptions} [options]
   * @returns {Promise<import("../draw/pick.js").Hit | null>} null if the ray does not become that opaque
   */
  async pick(x, y, options) {
    const { pickPixel } = await import("../draw/pick.js");
    return pickPixel(this, x, y, options);
  }

  /**
   * Finishes a picture part by part: each `step` of the result draws what a frame has time for.
   * @param {{boxFromClip: ArrayLike<number>, width: number, height: number, budgetMs: number}} how
   */
  async finishing(how) {
    const { Finishing } = await import("../draw/finish.js");
    return new Finishing(this, how);
  }

  /**
   * The known error of the last picture against the scan, as a record that other viewers may show.
   * @param {import("./fidelity.js").Measured} [measured] measurements of this device
   */
  async fidelity(measured) {
    const { fidelityOf } = await import("./fidelity.js");
    return fidelityOf(this, measured);
  }

  /**
   * The values on a plane across an axis of the patient, at the level that is drawn.
   * @param {import("../draw/slices.js").SliceOptions} [options]
   * @returns {Promise<import("../draw/slices.js").Slice | null>} null if the package's shaders read no values
   */
  async slice(options) {
    const { sliceOf } = await import("../draw/slices.js");
    return sliceOf(this, options);
  }

  /** For modules of this reader: the current drawing and the camera of its last picture; null without a drawing. */
  get inside() {
    const { drawn, device } = this._levels;
    const { edits, cut, light } = this._changes;
    const changed = { edited: edits.size > 0, cut: cut !== null, lit: light !== null };
    const [gl, pack, options] = [this.#gl, this.package, this.#options];
    return drawn && device && { gl, pack, options, drawn, device, last: this.#last, changed };
  }

  /** Frees everything on the GPU. Later requests for a level or a picture load nothing, and return false. */
  dispose() {
    this._levels.closed = true;
    this.#listeners.abort();
    this.#end();
  }

  /** @param {boolean} moving @returns {Quality} */
  #quality(moving) {
    if (!moving || this.#options.frameMs === Infinity) return { step: 1, scale: 1 };
    return this.#pace?.quality ?? { step: 2, scale: 0.8 };
  }

  async #measure() {
    const { Pace } = await import("../draw/motion_quality.js");
    this.#pace ??= new Pace(this.#gl, this.#options.frameMs ?? 33);
  }

  /**
   * Recompiles the shader for more planes of a picture, or loads the light of the volume that they cut.
   * @param {readonly (readonly number[])[]} planes @param {import("./drawing.js").Choice} choice
   */
  async #follow(planes, choice) {
    try {
      const { clip, cut, more } = this._changes;
      if (planes.length > more) await this.setClip(cut, planes.length);
      else if (clip?.lit?.sees(planes, choice)) await this._levels.refresh();
    } catch (error) {
      this.#options.onError?.(error);
    }
  }

  #whole() {
    const { drawingBufferWidth, drawingBufferHeight } = this.#gl;
    return /** @type {const} */ ([0, 0, drawingBufferWidth, drawingBufferHeight]);
  }

  async #restore() {
    try {
      // The measured time of the context before does not count.
      this.#pace = null;
      await this._levels.climb(true);
    } catch (error) {
      this.#options.onError?.(error);
    }
  }

  #end() {
    this._levels.end(() => this.#pace?.dispose());
  }
}

/**
 * Draws a package in a context. The coarsest level can be drawn when the promise is fulfilled; finer ones follow, and
 * `onchange` is called for each. Rejects with a `VolpkgError`, or with an AbortError if a signal ends it before.
 * @param {Gl | null} gl of `canvas.getContext`, which is null where a page has no WebGL: VP7010
 * @param {Package} pack
 * @param {RendererOptions} [options]
 * @returns {Promise<Renderer>}
 */
export async function createRenderer(gl, pack, options = {}) {
  if (!pack?.manifest) {
    await import("./messages.js");
    throw new VolpkgError("VP7017", { what: pack });
  }
  checkContext(gl, pack);
  return new Renderer(gl, pack, options).start();
}
