/**
 * Tests of a device. A context may offer a format, a filter or a size and then draw black. Therefore each capability
 * that is needed is first tested by drawing one pixel from a few texels; all of these pixels are read back at once.
 */
import { FORMATS, constant, isWebGl2, linearOf } from "./formats.js";
import { WHOLE, drawAll, forgetErrors, linkNow } from "./program.js";

/** @typedef {import("./formats.js").Gl} Gl */
/**
 * A capability: a format with a filter, or with a size along an axis of its texture.
 * @typedef {object} Want
 * @property {string} internal
 * @property {boolean} volume whether the texture is 3D
 * @property {boolean} nearest whether it is not filtered
 * @property {number} [size] texels along `axis`, 0 for x
 * @property {number} [axis]
 */
/** @typedef {{works: boolean, found: string, expected: string}} Result */

const LOW = 0.2;
const HIGH = 0.8;
/** Of 255: filters have weights of 8 bits, and halves of one block format are off by 6. */
const TOLERANCE = 4;
const FRAGMENT_2D = `precision highp float;
uniform sampler2D u_texels;
uniform vec4 u_at;
void main() {
  gl_FragColor = texture2D(u_texels, u_at.xy) * u_at.w + (1.0 - u_at.w);
}
`;
const VERTEX_3D = `#version 300 es
in vec2 a_ndc;
void main() {
  gl_Position = vec4(a_ndc, 0.0, 1.0);
}
`;
const FRAGMENT_3D = `#version 300 es
precision highp float;
uniform highp sampler3D u_texels;
uniform vec4 u_at;
out vec4 found;
void main() {
  found = textureLod(u_texels, u_at.xyz, 0.0) * u_at.w + (1.0 - u_at.w);
}
`;
/** @param {Want} want */
const keyOf = (want) =>
  `${want.internal} ${want.volume ? "3D" : "2D"} ${want.size ? `${want.size} along ${"xyz"[want.axis ?? 0]}` : want.nearest ? "nearest" : "linear"}`;

/** Stores the result. */
export class Probes {
  #gl;
  /** @type {Map<string, Result>} */
  found = new Map();
  /** How long it took, in all. */
  milliseconds = 0;
  /** For textures in 2D and in 3D, once they are needed. @type {(import("./program.js").Linked | undefined)[]} */
  #programs = [];

  /** @param {Gl} gl */
  constructor(gl) {
    this.#gl = gl;
  }

  /** The stored result of a probe. @param {Want} want */
  result(want) {
    return /** @type {Result} */ (this.found.get(keyOf(want)));
  }

  /** Draws what has not been drawn yet. @param {Want[]} wants */
  test(wants) {
    const fresh = [...new Map(wants.map((value) => [keyOf(value), value]))].filter(([key]) => !this.found.has(key));
    if (!fresh.length) return;
    const start = performance.now();
    const pixels = this.#draw(fresh.map(([, want]) => want));
    fresh.forEach(([key, want], i) => {
      const { red, alpha } = expected(want);
      const found = [pixels[4 * i], pixels[4 * i + 3]];
      const near = (/** @type {number} */ a, /** @type {number} */ b) => Math.abs(a - b * 255) <= TOLERANCE;
      this.found.set(key, {
        works: near(found[0], red) && (alpha === undefined || near(found[1], alpha)),
        found: (found[0] / 255).toFixed(3),
        expected: red.toFixed(3),
      });
    });
    this.milliseconds += performance.now() - start;
  }

  dispose() {
    for (const program of this.#programs) if (program) this.#gl.deleteProgram(program.handle);
  }

  /** @param {Want[]} wants @returns {Uint8Array} a pixel for each */
  #draw(wants) {
    const gl = this.#gl;
    const made = /** @type {WebGLTexture[]} */ ([]);
    const texture = () => (made[made.length] = /** @type {WebGLTexture} */ (gl.createTexture()));
    const pixels = new Uint8Array(4 * wants.length);
    const picture = texture();
    const frame = gl.createFramebuffer();
    const corners = gl.createBuffer();
    gl.bindTexture(gl.TEXTURE_2D, picture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, wants.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, picture, 0);
    gl.bindTexture(gl.TEXTURE_2D, null);
    drawAll(gl);
    gl.bindBuffer(gl.ARRAY_BUFFER, corners);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.activeTexture(gl.TEXTURE0);
    wants.forEach((want, i) => {
      if ((want.volume && !isWebGl2(gl)) || !fill(gl, want, texture())) return;
      const program = (this.#programs[Number(want.volume)] ??= linkNow(
        gl,
        "probe",
        want.volume ? VERTEX_3D : WHOLE,
        want.volume ? FRAGMENT_3D : FRAGMENT_2D,
      ));
      gl.viewport(i, 0, 1, 1);
      gl.useProgram(program.handle);
      gl.uniform1i(program.locations.u_texels, 0);
      const at = [0.5, 0.5, 0.5, want.internal.endsWith("SNORM") ? 0.5 : 1];
      if (want.size) at[want.axis ?? 0] = (want.size - 0.5) / want.size;
      else if (want.nearest) at[0] = 0.75;
      gl.uniform4fv(program.locations.u_at, at);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    });
    gl.readPixels(0, 0, wants.length, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    forgetErrors(gl);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    for (const value of made) gl.deleteTexture(value);
    gl.deleteFramebuffer(frame);
    gl.deleteBuffer(corners);
    return pixels;
  }
}

/** @param {Want} want @returns {{red: number, alpha?: number}} */
function expected({ internal, nearest, size }) {
  const { sample, components, format } = FORMATS[internal];
  if (sample) return { red: sample.red };
  const mean = (/** @type {number} */ low, /** @type {number} */ high) => (nearest || size ? high : (low + high) / 2);
  const alpha = components === 4 || format === "LUMINANCE_ALPHA" ? mean(LOW, HIGH) : undefined;
  // sRGB is decoded before it is filtered; alpha is linear.
  return {
    red: internal.startsWith("SRGB") ? mean(linearOf(LOW), linearOf(HIGH)) : mean(LOW, HIGH),
    alpha,
  };
}

/**
 * Fills a texture with two texels, or `want.size` texels. The last one is bright.
 * @param {Gl} gl @param {Want} want @param {WebGLTexture} texture
 */
function fill(gl, want, texture) {
  const { format, type, components, block, extension, sample } = FORMATS[want.internal];
  const internal = constant(gl, want.internal, extension);
  if (internal === undefined) return false;
  const target = want.volume ? /** @type {WebGL2RenderingContext} */ (gl).TEXTURE_3D : gl.TEXTURE_2D;
  gl.bindTexture(target, texture);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  const near = want.nearest || want.size ? gl.NEAREST : gl.LINEAR;
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, near],
    [gl.TEXTURE_MAG_FILTER, near],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) {
    gl.texParameteri(target, name, value);
  }
  if (sample) {
    gl.compressedTexImage2D(target, 0, internal, block, block, 0, new Uint8Array(sample.texels));
    return true;
  }
  const size = [1, 1, 1];
  size[want.axis ?? 0] = want.size ?? 2;
  const [x, y, z] = size;
  const texels = numbers(/** @type {string} */ (type), x * y * z * components, components);
  const pixels = /** @type {const} */ ([
    0,
    /** @type {any} */ (gl)[/** @type {string} */ (format)],
    /** @type {any} */ (gl)[/** @type {string} */ (type)],
    texels,
  ]);
  if (want.volume) /** @type {WebGL2RenderingContext} */ (gl).texImage3D(target, 0, internal, x, y, z, ...pixels);
  else gl.texImage2D(target, 0, internal, x, y, ...pixels);
  return true;
}

/** @param {string} type @param {number} count @param {number} components */
function numbers(type, count, components) {
  const [List, code] = /** @type {Record<string, [any, (v: number) => number]>} */ ({
    UNSIGNED_BYTE: [Uint8Array, (v) => v * 255],
    BYTE: [Int8Array, (v) => (2 * v - 1) * 127],
    UNSIGNED_SHORT: [Uint16Array, (v) => v * 65535],
    // The half floats of the two.
    HALF_FLOAT: [Uint16Array, (v) => (v === LOW ? 0x3266 : 0x3a66)],
    FLOAT: [Float32Array, (v) => v],
  })[type];
  const value = (/** @type {number} */ v) => (type === "FLOAT" ? v : Math.round(code(v)));
  return new List(count).fill(value(LOW)).fill(value(HIGH), count - components);
}
