/** GPU objects that all pictures share, and checks that a device can draw a package. */
import { bytesOf, sharing } from "../core/drawing.js";
import { VolpkgError } from "../core/error.js";
import { isWebGl2 } from "./formats.js";
import { Probes } from "./probe.js";
import { drawAll, link } from "./program.js";
import { passesOf } from "../core/shapes.js";
import { Pictures } from "./target.js";
import { Textures } from "./textures.js";

/** @typedef {import("../core/drawing.js").Choice} Choice */
/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {import("../core/package.js").Package} Package */
/** @typedef {import("./program.js").Linked} Linked */

const CORNERS = new Float32Array([-1, -1, 3, -1, -1, 3]);

/**
 * Throws unless the context is one that the package is for.
 * @param {Gl | null} gl @param {Package} pack
 * @returns {asserts gl is Gl}
 */
export function checkContext(gl, pack) {
  const { api } = pack.manifest.profile;
  const refuse = (/** @type {string} */ needed, /** @type {string} */ found) =>
    new VolpkgError("VP7010", { needed, found });
  if (!gl?.getShaderPrecisionFormat) throw refuse("a WebGL context", "none");
  if (gl.isContextLost()) throw new VolpkgError("VP7018", { problem: "the context is lost" });
  if (api === "es1.1") throw refuse("OpenGL ES 1.1, which draws slices without shaders", "WebGL");
  if (api === "es3.0" && !isWebGl2(gl)) throw refuse("WebGL 2", "WebGL 1");
  const { precision = 0 } = gl.getShaderPrecisionFormat(gl.FRAGMENT_SHADER, gl.HIGH_FLOAT) ?? {};
  if (!(precision >= 23)) throw refuse("fragment shaders with float32", "less precise ones");
}

/**
 * Throws if the device cannot draw a choice.
 * @param {Gl} gl @param {Package} pack @param {Choice} choice @param {number} [limit] of the bytes of all textures
 */
export function checkFits(gl, { manifest }, choice, limit = manifest.profile.max_texture_bytes) {
  const { program, textures, level } = choice;
  const units = gl.getParameter(gl.MAX_TEXTURE_IMAGE_UNITS);
  const count = program.samplers.length + passesOf(program).length;
  if (count > units) throw new VolpkgError("VP7012", { name: program.name, count, limit: units });
  for (const { name, gl: how, shape_zyx: shape } of textures.flatMap((texture) => sharing(manifest, texture))) {
    const most = gl.getParameter(how.target === "TEXTURE_3D" ? 0x8073 : gl.MAX_TEXTURE_SIZE) ?? 0;
    const axis = shape.findIndex((size) => size > most);
    if (axis >= 0)
      throw new VolpkgError("VP7011", {
        name,
        axis: ["depth", "height", "width"][axis],
        size: shape[axis],
        limit: most,
      });
  }
  const size = bytesOf(manifest, choice);
  if (size > limit) throw new VolpkgError("VP7013", { level: level.index, size, limit });
}

/** The objects of a context. */
export class Device {
  #gl;
  #corners;
  #array;
  /** @type {Map<string, Linked>} */
  #programs = new Map();

  /** @param {Gl} gl @param {Package} pack */
  constructor(gl, pack) {
    checkContext(gl, pack);
    this.#gl = gl;
    this.#corners = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#corners);
    gl.bufferData(gl.ARRAY_BUFFER, CORNERS, gl.STATIC_DRAW);
    this.#array = isWebGl2(gl) ? gl.createVertexArray() : null;
    this.pictures = new Pictures(gl, () => this.triangle());
    this.textures = new Textures(gl, pack);
    this.probes = new Probes(gl);
    this.unbind();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** Binds the triangle that covers the picture. */
  triangle() {
    const gl = this.#gl;
    if (isWebGl2(gl)) gl.bindVertexArray(this.#array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#corners);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
  }

  /** Leaves vertex arrays to the app. */
  unbind() {
    if (isWebGl2(this.#gl)) this.#gl.bindVertexArray(null);
  }

  /** Sets the state of pictures. @param {boolean} blend with the existing picture */
  state(blend) {
    const gl = this.#gl;
    drawAll(gl);
    if (!blend) return;
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.FUNC_ADD);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  /** A program, linked once. @param {string} key @param {() => Promise<Parameters<typeof link>[1]>} texts */
  async linked(key, texts) {
    const found = this.#programs.get(key) ?? (await link(this.#gl, await texts()));
    this.#programs.set(key, found);
    return found;
  }

  dispose() {
    const gl = this.#gl;
    this.textures.keep([]);
    this.pictures.dispose();
    this.probes.dispose();
    for (const { handle } of this.#programs.values()) gl.deleteProgram(handle);
    gl.deleteBuffer(this.#corners);
    if (isWebGl2(gl)) gl.deleteVertexArray(this.#array);
  }
}
