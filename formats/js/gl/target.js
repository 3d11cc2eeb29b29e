/** Where pictures are drawn: a linear target, and the pass that shows it. spec/README.md and spec/webgl.md. */
import { VolpkgError } from "../core/error.js";
import { fromHalf, isWebGl2, linearOf } from "./formats.js";
import { WHOLE, drawAll, driverOf, forgetErrors, linkNow } from "./program.js";

/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {{name: string, internal: number, format: number, type: number}} Kind */

const PRESENT = `precision highp float;
uniform sampler2D u_picture;
uniform vec4 u_place;
uniform vec3 u_background;
void main() {
  vec4 picture = texture2D(u_picture, (gl_FragCoord.xy - u_place.xy) * u_place.zw);
  vec3 light = clamp(picture.rgb + (1.0 - picture.a) * u_background, 0.0, 1.0);
  vec3 encoded = mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light));
  gl_FragColor = vec4(encoded, 1.0);
}
`;
/** A colour that no format of 8 linear bits holds. */
const FAINT = 1 / 1024;
const CONSTANT = `precision highp float;
void main() {
  gl_FragColor = vec4(${FAINT}, 0.5, 2.0, 1.0);
}
`;

/** @param {Gl} gl @returns {Kind} */
const kindOfBytes = (gl) => ({ name: "RGBA8", internal: gl.RGBA, format: gl.RGBA, type: gl.UNSIGNED_BYTE });

/**
 * Formats for a linear picture, the best one first. The last one shows bands in dark parts.
 * @param {Gl} gl @returns {Kind[]}
 */
function kinds(gl) {
  const last = kindOfBytes(gl);
  if (isWebGl2(gl)) {
    const float = gl.getExtension("EXT_color_buffer_float") ?? gl.getExtension("EXT_color_buffer_half_float");
    const srgb = { name: "SRGB8_ALPHA8", internal: gl.SRGB8_ALPHA8, format: gl.RGBA, type: gl.UNSIGNED_BYTE };
    const wide = { name: "RGBA16F", internal: gl.RGBA16F, format: gl.RGBA, type: gl.HALF_FLOAT };
    return [...(float ? [wide] : []), srgb, last];
  }
  const half = gl.getExtension("OES_texture_half_float");
  gl.getExtension("EXT_color_buffer_half_float");
  const linear = half && gl.getExtension("OES_texture_half_float_linear");
  return linear ? [{ name: "RGBA16F", internal: gl.RGBA, format: gl.RGBA, type: half.HALF_FLOAT_OES }, last] : [last];
}

/** The format of linear pictures on a device, and the program that shows them. */
export class Pictures {
  #gl;
  #corners;
  /** By the app's key. @type {Map<object | undefined, Picture>} */
  #kept = new Map();

  /** @param {Gl} gl @param {() => void} corners binds the triangle */
  constructor(gl, corners) {
    this.#gl = gl;
    this.#corners = corners;
    this.present = linkNow(gl, "present", WHOLE, PRESENT);
    this.kind = this.#working(kinds(gl));
  }

  /** The picture that is kept under a key. @param {object} [key] */
  of(key) {
    const found = this.#kept.get(key) ?? new Picture(this.#gl, this.kind);
    this.#kept.set(key, found);
    return found;
  }

  /** Frees the picture of a key. @param {object} key */
  forget(key) {
    this.#kept.get(key)?.dispose();
    this.#kept.delete(key);
  }

  /**
   * Shows a picture, encoded as sRGB, in the framebuffer that is bound.
   * @param {WebGLTexture | null} texture @param {readonly number[]} viewport x, y, width, height
   * @param {readonly number[]} background linear red, green, blue
   */
  show(texture, [x, y, width, height], background) {
    const gl = this.#gl;
    gl.viewport(x, y, width, height);
    gl.useProgram(this.present.handle);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const { u_picture, u_place, u_background } = this.present.locations;
    gl.uniform1i(u_picture, 0);
    gl.uniform4f(u_place, x, y, 1 / width, 1 / height);
    gl.uniform3f(u_background, background[0], background[1], background[2]);
    this.#corners();
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  dispose() {
    for (const each of this.#kept.values()) each.dispose();
    this.#gl.deleteProgram(this.present.handle);
  }

  /** The first kind that stores pictures correctly. @param {Kind[]} all */
  #working(all) {
    const gl = this.#gl;
    const draw = linkNow(gl, "constant", WHOLE, CONSTANT);
    const found = all.find((kind) => {
      if (kind === all[all.length - 1]) return true;
      const trial = new Picture(gl, kind);
      trial.bind(1, 1);
      drawAll(gl);
      gl.viewport(0, 0, 1, 1);
      gl.useProgram(draw.handle);
      this.#corners();
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      const shown = this.#shown(trial.texture);
      trial.dispose();
      // FAINT is 3 of 255 in sRGB, 0 as a byte.
      return Math.abs(shown[0] - 255 * 12.92 * FAINT) < 1.6 && Math.abs(shown[1] - 188) < 2 && shown[2] === 255;
    });
    gl.deleteProgram(draw.handle);
    forgetErrors(gl);
    return /** @type {Kind} */ (found);
  }

  /** One pixel of a picture, as it is shown. @param {WebGLTexture | null} picture */
  #shown(picture) {
    const gl = this.#gl;
    const pixel = new Uint8Array(4);
    const shown = new Picture(gl, kindOfBytes(gl));
    shown.bind(1, 1);
    this.show(picture, [0, 0, 1, 1], [0, 0, 0]);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    shown.dispose();
    return pixel;
  }
}

/** A linear picture at the size of the drawing. */
export class Picture {
  #gl;
  #kind;
  /** @type {WebGLTexture | null} */
  #texture = null;
  /** @type {WebGLFramebuffer | null} */
  #frame = null;
  width = 0;
  height = 0;

  /** @param {Gl} gl @param {Kind} kind */
  constructor(gl, kind) {
    this.#gl = gl;
    this.#kind = kind;
  }

  /** Format that it is kept in. */
  get format() {
    return this.#kind.name;
  }

  /** Texture of the picture. */
  get texture() {
    return this.#texture;
  }

  /** Framebuffer of the picture. */
  get frame() {
    return this.#frame;
  }

  /** Binds it as the render target. @param {number} width @param {number} height */
  bind(width, height) {
    const gl = this.#gl;
    const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (!(width >= 1 && height >= 1 && width <= limit && height <= limit)) {
      throw new VolpkgError("VP5009", { driver: driverOf(gl), width, height, limit });
    }
    if (width !== this.width || height !== this.height || !this.#texture) {
      this.#free();
      this.#make(width, height);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame);
  }

  /** Reads one pixel, for which the GPU must have finished. */
  readOne() {
    this.#pixels(1, 1);
  }

  /** Premultiplied linear RGBA, row 0 on top. @returns {Float32Array} */
  read() {
    const gl = this.#gl;
    const { width, height } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame);
    const row = 4 * width;
    const upright = new Float32Array(row * height);
    const { texels, value } = this.#pixels(width, height);
    for (let y = 0; y < height; y++) {
      for (let i = 0; i < row; i++) upright[(height - 1 - y) * row + i] = value(texels[y * row + i], i % 4);
    }
    return upright;
  }

  dispose() {
    this.#free();
  }

  /**
   * Reads texels; `value` converts one of them to linear light.
   * @param {number} width @param {number} height
   * @returns {{texels: ArrayLike<number>, value: (texel: number, channel: number) => number}}
   */
  #pixels(width, height) {
    const gl = this.#gl;
    const { name, type } = this.#kind;
    const count = 4 * width * height;
    const read = (/** @type {number} */ as, /** @type {Float32Array | Uint8Array | Uint16Array} */ texels) => {
      gl.readPixels(0, 0, width, height, gl.RGBA, as, texels);
      return texels;
    };
    if (name === "RGBA16F") {
      if (gl.getExtension("EXT_color_buffer_float") || !isWebGl2(gl))
        return { texels: read(gl.FLOAT, new Float32Array(count)), value: (texel) => texel };
      return { texels: read(type, new Uint16Array(count)), value: fromHalf };
    }
    const encoded = name === "SRGB8_ALPHA8";
    return {
      texels: read(gl.UNSIGNED_BYTE, new Uint8Array(count)),
      value: (texel, channel) => (encoded && channel < 3 ? linearOf(texel / 255) : texel / 255),
    };
  }

  /** @param {number} width @param {number} height */
  #make(width, height) {
    const gl = this.#gl;
    const kind = this.#kind;
    this.#texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.#texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, kind.internal, width, height, 0, kind.format, kind.type, null);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    this.#frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.#texture, 0);
    this.width = width;
    this.height = height;
  }

  #free() {
    const gl = this.#gl;
    gl.deleteTexture(this.#texture);
    gl.deleteFramebuffer(this.#frame);
    this.#texture = this.#frame = null;
  }
}
