/** The picture: the one module that draws. It draws when something has changed, and coarser while the camera moves. */
import { Orbit } from "../runtime/camera.js";
import { createRenderer } from "../runtime/volpkg.js";
import { PageError, showProblem } from "./problems.js";

const REST_MS = 160;
/** More pixels than this along an axis are drawn smaller and shown larger. */
const MOST_PIXELS = 2048;
const LINEAR = { black: [0, 0, 0], white: [1, 1, 1] };

/** The view in which the page begins: it shows three sides. */
export const FIRST_VIEW = "anterior-left";

/** A renderer on a canvas, with a camera that people turn. */
export class Stage {
  #canvas;
  #pack;
  /** @type {any} */
  #gl = null;
  #asked = 0;
  #rest = 0;
  #busy = false;
  /** @type {"black" | "white"} */
  #background = "black";
  /** Told when the renderer has something new to say: another level, another time. @type {() => void} */
  onchange = () => {};

  /** @param {HTMLCanvasElement} canvas @param {import("../runtime/volpkg.js").Package} pack */
  constructor(canvas, pack) {
    this.#canvas = canvas;
    this.#pack = pack;
    this.orbit = new Orbit(pack.manifest.grid, pack.manifest.render.projection ?? "orthographic");
    this.orbit.look(FIRST_VIEW);
    /** @type {import("../runtime/volpkg.js").Renderer} */
    this.renderer = /** @type {any} */ (null);
  }

  /** Begins to draw. Throws what the runtime throws, with a code. */
  async start() {
    this.#gl = contextOf(this.#canvas, this.#pack.manifest.profile.api);
    const onError = (/** @type {unknown} */ error) => showProblem(error);
    this.renderer = await createRenderer(this.#gl, this.#pack, { onError });
    this.renderer.onchange = () => {
      this.redraw();
      this.onchange();
    };
    this.#canvas.addEventListener("webglcontextrestored", () => showProblem(null));
    new ResizeObserver(() => this.redraw()).observe(this.#canvas);
    this.redraw();
  }

  /** What the picture is drawn on. */
  get gl() {
    return this.#gl;
  }

  /** @param {"black" | "white"} name */
  set background(name) {
    this.#background = name;
    this.redraw();
  }

  /** Draws the next picture soon. */
  redraw() {
    this.#asked ||= requestAnimationFrame(() => {
      this.#asked = 0;
      if (this.#busy || !this.renderer) return;
      try {
        this.#draw();
      } catch (error) {
        showProblem(error);
      }
    });
  }

  /** The camera moves: draws coarser until it has rested for a moment. */
  moving() {
    this.renderer?.interacting(true);
    clearTimeout(this.#rest);
    this.#rest = setTimeout(() => this.renderer.interacting(false), REST_MS);
    this.redraw();
  }

  /** The picture as a PNG file, at full quality. @returns {Promise<Blob>} */
  picture() {
    clearTimeout(this.#rest);
    this.renderer.interacting(false);
    this.#draw();
    // Read in the same task: afterwards the browser may have cleared the canvas.
    return new Promise((resolve, reject) => {
      this.#canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser makes no PNG file of the picture"))));
    });
  }

  /**
   * Lends the renderer to a measurement, which draws off the screen; the picture stands still meanwhile.
   * @template T
   * @param {number} size width and height of the pictures
   * @param {(bench: import("./measuring.js").Bench) => Promise<T>} work
   */
  async lend(size, work) {
    const { program, level, step, packageStep } = this.renderer;
    const targets = [target(this.#gl, size), target(this.#gl, size)];
    this.#busy = true;
    clearTimeout(this.#rest);
    this.renderer.interacting(false);
    try {
      return await work(this.#bench(targets, size));
    } finally {
      for (const each of targets) each.free();
      await this.renderer.setProgram(program).catch(showProblem);
      await this.renderer.setLevel(level).catch(showProblem);
      this.renderer.setStep(step === packageStep ? undefined : step);
      this.#busy = false;
      this.redraw();
    }
  }

  /** @param {ReturnType<typeof target>[]} targets @param {number} size @returns {import("./measuring.js").Bench} */
  #bench(targets, size) {
    const { renderer } = this;
    const gl = this.#gl;
    const viewport = /** @type {const} */ ([0, 0, size, size]);
    let last = targets[0];
    const found = () => Object.entries(renderer.probes.found).map(([name, { works, found: is, expected }]) => ({ name, passed: works, note: works ? "" : `gives ${is} in place of ${expected}` }));
    return {
      gl,
      manifest: this.#pack.manifest,
      get probes() {
        return found();
      },
      choose: async (transfer, level) => {
        if (renderer.program !== transfer) await renderer.setProgram(transfer);
        if (renderer.level !== level) await renderer.setLevel(level);
        if (renderer.program !== transfer || renderer.level !== level) throw new Error(`level ${level} of ${transfer} cannot be drawn here`);
      },
      draw: (rows, stepMm, index) => {
        if (renderer.step !== stepMm) renderer.setStep(stepMm);
        last = targets[index % 2];
        renderer.draw({ boxFromClip: columns(rows), viewport, target: last.frame });
      },
      wait: () => {
        gl.bindFramebuffer(gl.FRAMEBUFFER, last.frame);
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      },
      pixels: () => {
        const pixels = new Uint8Array(4 * size * size);
        gl.bindFramebuffer(gl.FRAMEBUFFER, last.frame);
        gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        return upright(pixels, size);
      },
    };
  }

  #draw() {
    const { clientWidth, clientHeight } = this.#canvas;
    if (!clientWidth || !clientHeight) return;
    const ratio = Math.min(window.devicePixelRatio || 1, MOST_PIXELS / Math.max(clientWidth, clientHeight));
    const [width, height] = [Math.max(1, Math.round(clientWidth * ratio)), Math.max(1, Math.round(clientHeight * ratio))];
    if (this.#canvas.width !== width || this.#canvas.height !== height) Object.assign(this.#canvas, { width, height });
    this.renderer.draw({ boxFromClip: fitting(this.orbit, width / height) });
    this.renderer.present({ background: LINEAR[this.#background] });
  }
}

/**
 * The camera's matrix for a picture of any shape: the height of the field is that of a square one, so that in an upright
 * picture the volume would stick out left and right.
 * @param {Orbit} orbit @param {number} aspect
 */
function fitting(orbit, aspect) {
  if (aspect >= 1) return orbit.boxFromClip(aspect);
  const { zoom } = orbit;
  orbit.zoom = zoom * aspect;
  const matrix = orbit.boxFromClip(aspect);
  orbit.zoom = zoom;
  return matrix;
}

/** @param {HTMLCanvasElement} canvas @param {string} api */
function contextOf(canvas, api) {
  let reason = "it gives no reason";
  canvas.addEventListener("webglcontextcreationerror", (event) => {
    reason = /** @type {WebGLContextEvent} */ (event).statusMessage || reason;
  });
  const attributes = { alpha: false, antialias: false, depth: false, stencil: false, powerPreference: "high-performance" };
  for (const kind of api === "es2.0" ? ["webgl", "webgl2"] : ["webgl2", "webgl"]) {
    const gl = canvas.getContext(kind, attributes);
    if (gl) return gl;
  }
  throw new PageError("VP7041", { reason });
}

/** A target of 8 bits, as that of validation. @param {any} gl @param {number} size */
function target(gl, size) {
  const texture = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, size, size, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  const frame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  const free = () => {
    gl.deleteFramebuffer(frame);
    gl.deleteTexture(texture);
  };
  return { frame, free };
}

/** A matrix that is listed row by row, column by column. @param {number[]} rows */
const columns = (rows) => rows.map((_, at) => rows[4 * (at % 4) + (at >> 2)]);

/** Row 0 on top. @param {Uint8Array} pixels @param {number} size */
function upright(pixels, size) {
  const row = 4 * size;
  const turned = new Uint8Array(pixels.length);
  for (let y = 0; y < size; y++) turned.set(pixels.subarray(y * row, (y + 1) * row), (size - 1 - y) * row);
  return turned;
}
