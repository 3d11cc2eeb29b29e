/** A canvas with a camera that people turn: a picture is drawn when something has changed, and coarser in motion. */
import { Orbit } from "../camera.js";
import { VolpkgError } from "../core/error.js";
import { linearOf } from "../gl/formats.js";
import { createRenderer } from "../core/renderer.js";

/** @typedef {import("../core/package.js").Package} Package */
/** @typedef {import("../core/renderer.js").Renderer} Renderer */
/** @typedef {import("../core/renderer.js").RendererOptions} RendererOptions */

const REST_MS = 160;
/** More pixels than this along an axis are drawn smaller and shown larger. */
const MOST_PIXELS = 2048;

/** The view in which pictures begin: it shows three sides. */
export const FIRST_VIEW = "anterior-left";

/** A renderer on a canvas. Get one with `new Stage` and `start`. */
export class Stage {
  #canvas;
  #pack;
  #onError;
  /** @type {any} */
  #gl = null;
  #asked = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #rest;
  /** @type {number[]} */
  #background = [0, 0, 0];
  #observer = new ResizeObserver(() => this.redraw());
  /** For slow pictures. @type {import("../draw/finisher.js").Finisher | null} */
  #finisher = null;
  /** Points of the ruler. @type {import("./points.js").Point[]} */
  points = [];
  /** Whether another user holds the renderer. */
  busy = false;
  /** Called when the renderer has something new to say: another level, another time. @type {() => void} */
  onchange = () => {};
  /** Called after each picture. @type {() => void} */
  ondraw = () => {};
  /** Called with the name of a view when the camera takes it, with "" when it was moved. @type {(name: string) => void} */
  onview = () => {};

  /** @param {HTMLCanvasElement} canvas @param {Package} pack @param {(error: unknown) => void} onError */
  constructor(canvas, pack, onError) {
    this.#canvas = canvas;
    this.#pack = pack;
    this.#onError = onError;
    this.orbit = new Orbit(
      pack.manifest.pictures[0]?.grid ?? pack.manifest.grid,
      pack.manifest.render.projection ?? "orthographic",
    );
    this.orbit.look(FIRST_VIEW);
    /** @type {Renderer} */
    this.renderer = /** @type {any} */ (null);
  }

  /**
   * Starts drawing. Throws the renderer's errors, with a code.
   * @param {RendererOptions & {create?: (gl: any, pack: Package, options: RendererOptions) => Promise<Renderer>}} [options]
   *   `create` makes another renderer than the runtime's
   */
  async start({ create = createRenderer, ...options } = {}) {
    this.#gl = await contextOf(this.#canvas, this.#pack.manifest.profile.api);
    const renderer = await create(this.#gl, this.#pack, { onError: this.#onError, ...options });
    this.renderer = renderer;
    renderer.onchange = () => {
      this.redraw();
      this.onchange();
    };
    this.#observer.observe(this.#canvas);
    this.redraw();
  }

  /** The canvas of the picture. */
  get gl() {
    return this.#gl;
  }

  /** Background colour: encoded red, green and blue, 0 to 1. @param {readonly number[]} colour */
  set backdrop(colour) {
    this.#background = colour.map(linearOf);
    this.redraw();
  }

  /** Draws the next picture soon. */
  redraw() {
    this.#asked ||= requestAnimationFrame(() => {
      this.#asked = 0;
      if (this.busy || !this.renderer) return;
      try {
        this.draw(true);
      } catch (error) {
        this.#onError(error);
      }
    });
  }

  /** Takes a standard view. @param {string} [name] @returns {boolean} false for an unknown name */
  look(name = FIRST_VIEW) {
    const known = this.orbit.look(name);
    if (known) this.onview(name);
    this.redraw();
    return known;
  }

  /** The camera moves: draws coarser until it has rested for a moment. */
  moving() {
    this.onview("");
    this.renderer?.interacting(true);
    clearTimeout(this.#rest);
    this.#rest = setTimeout(() => this.renderer.interacting(false), REST_MS);
    this.redraw();
  }

  /** Ends motion at once. */
  still() {
    clearTimeout(this.#rest);
    this.renderer.interacting(false);
  }

  /** The picture as a PNG file, at full quality. @returns {Promise<Blob>} */
  async picture() {
    const { pngOf } = await import("./element_tools.js");
    this.still();
    this.draw();
    // In the same task: afterwards the browser may have cleared the canvas.
    return pngOf(this.#canvas);
  }

  /** Draws now, as large as the canvas is on the page. @param {boolean} [inParts] whether a slow picture may come part by part */
  draw(inParts = false) {
    const { clientWidth, clientHeight } = this.#canvas;
    if (!clientWidth || !clientHeight) return;
    const ratio = Math.min(window.devicePixelRatio || 1, MOST_PIXELS / Math.max(clientWidth, clientHeight));
    const [width, height] = [clientWidth, clientHeight].map((value) => Math.max(1, Math.round(value * ratio)));
    if (this.#canvas.width !== width || this.#canvas.height !== height) Object.assign(this.#canvas, { width, height });
    const view = { boxFromClip: fitting(this.orbit, width / height, this.renderer.grid), width, height };
    const { moving, slow } = this.renderer;
    const inTurns = inParts && !moving && slow;
    if (this.#finisher?.draw(view, inTurns)) this.redraw();
    else if (!this.#finisher) {
      this.renderer.draw({ ...view, moving: moving || inTurns });
      if (inTurns) this.#finish();
    }
    this.renderer.present({ background: this.#background });
    this.ondraw();
  }

  async #finish() {
    try {
      const { Finisher } = await import("../draw/finisher.js");
      this.#finisher ??= new Finisher(this.renderer);
      this.redraw();
    } catch (error) {
      this.#onError(error);
    }
  }

  /** Frees everything on the GPU, and the context with it. */
  dispose() {
    clearTimeout(this.#rest);
    cancelAnimationFrame(this.#asked);
    this.#observer.disconnect();
    this.renderer?.dispose();
    this.#gl?.getExtension("WEBGL_lose_context")?.loseContext();
  }
}

/**
 * The camera's matrix for a picture of any shape: the height of the field is that of a square one, so that in an
 * upright picture the volume would stick out left and right.
 * @param {Orbit} orbit @param {number} aspect @param {import("../core/types.js").Grid} grid
 */
function fitting(orbit, aspect, grid) {
  const { zoom } = orbit;
  orbit.zoom *= Math.min(aspect, 1);
  const matrix = orbit.boxFromClip(aspect, grid);
  orbit.zoom = zoom;
  return matrix;
}

/** @param {HTMLCanvasElement} canvas @param {string} api */
async function contextOf(canvas, api) {
  let reason = "it gives no reason";
  canvas.addEventListener("webglcontextcreationerror", (event) => {
    reason = /** @type {WebGLContextEvent} */ (event).statusMessage || reason;
  });
  const attributes = {
    alpha: false,
    antialias: false,
    depth: false,
    stencil: false,
    powerPreference: "high-performance",
  };
  for (const kind of api === "es2.0" ? ["webgl", "webgl2"] : ["webgl2", "webgl"]) {
    const gl = canvas.getContext(kind, attributes);
    if (gl) return gl;
  }
  await import("../core/messages.js");
  throw new VolpkgError("VP7041", { reason });
}
