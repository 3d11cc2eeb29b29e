/**
 * Keeps memory low while a texture is uploaded. Drivers hold a copy of the uploaded texels, as large as the texture,
 * until the texture is first drawn. Therefore one texel is drawn after each slab.
 */
import { linkNow } from "./program.js";

/** @typedef {import("./formats.js").Gl} Gl */

const VERTEX = "void main() {\n  gl_Position = vec4(0.0, 0.0, 0.0, 1.0);\n  gl_PointSize = 1.0;\n}\n";
const FRAGMENT =
  "precision mediump float;\nuniform sampler2D u_texels;\nvoid main() {\n  gl_FragColor = texture2D(u_texels, vec2(0.5));\n}\n";

/** Draws a texel of one texture. */
export class Settler {
  #gl;
  #program;
  #pixel;
  #frame;

  /** @param {Gl} gl */
  constructor(gl) {
    this.#gl = gl;
    this.#program = linkNow(gl, "settle", VERTEX, FRAGMENT);
    this.#pixel = gl.createTexture();
    this.#frame = gl.createFramebuffer();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.#pixel);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
  }

  /** Waits until the GPU has everything that was sent to a texture. @param {WebGLTexture} texture */
  settle(texture) {
    const gl = this.#gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.#pixel, 0);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.viewport(0, 0, 1, 1);
    gl.useProgram(this.#program.handle);
    // Its buffer may be gone.
    gl.disableVertexAttribArray(0);
    gl.drawArrays(gl.POINTS, 0, 1);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  dispose() {
    const gl = this.#gl;
    gl.deleteProgram(this.#program.handle);
    gl.deleteTexture(this.#pixel);
    gl.deleteFramebuffer(this.#frame);
  }
}
