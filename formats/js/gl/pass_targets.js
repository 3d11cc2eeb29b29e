/** Targets of passes: one texture for each, in a format that is probed first. spec/passes.md. */
import { VolpkgError } from "../core/messages.js";
import { isWebGl2 } from "./formats.js";
import { WHOLE, forgetErrors, linkNow } from "./program.js";

/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {"rgba8" | "rgba16f" | "rgba32f"} Format */
/** @typedef {{texture: WebGLTexture | null, frame: WebGLFramebuffer | null, depth?: WebGLRenderbuffer | null}} Target */

/** Bytes of a texel. */
export const TEXEL_BYTES = { rgba8: 4, rgba16f: 8, rgba32f: 16 };

const VALUE = "precision highp float;\nuniform float u_value;\nvoid main() {\n  gl_FragColor = vec4(u_value);\n}\n";
const SHOWN = `precision highp float;
uniform sampler2D u_texels;
uniform vec3 u_how;
void main() {
  gl_FragColor = (texture2D(u_texels, vec2(u_how.x, 0.5)) - u_how.y) * u_how.z;
}
`;
/**
 * A trial of each format: the value drawn into the left one of two texels, and how it is read back at `at`. Half floats
 * are blended and filtered; 32-bit floats hold a value that half floats cannot hold.
 */
const TRIALS = {
  rgba16f: { value: 0.5, times: 2, at: 0.5, from: 0, scale: 1, expected: 0.375 },
  rgba32f: { value: 1000.25, times: 1, at: 0.25, from: 1000, scale: 2, expected: 0.5 },
};
/** Of 255. */
const TOLERANCE = 2;

/** Whether a context says that it draws into a format. @param {Gl} gl @param {Format} format */
export function claims(gl, format) {
  if (format === "rgba8") return true;
  return (
    isWebGl2(gl) &&
    Boolean(
      gl.getExtension("EXT_color_buffer_float") ??
        (format === "rgba16f" && gl.getExtension("EXT_color_buffer_half_float")),
    )
  );
}

/**
 * A texture and its framebuffer, which is bound; null if nothing can be drawn into it.
 * @param {Gl} gl @param {Format} format @param {number} width @param {number} height @param {boolean} linear whether it is filtered
 * @param {boolean} [deep] whether it has a depth buffer
 * @returns {Target | null}
 */
export function makeTarget(gl, format, width, height, linear, deep = false) {
  const texture = gl.createTexture();
  const frame = gl.createFramebuffer();
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  if (format === "rgba8" || !isWebGl2(gl))
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
  else if (format === "rgba16f")
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, width, height, 0, gl.RGBA, gl.HALF_FLOAT, null);
  else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, null);
  const near = linear ? gl.LINEAR : gl.NEAREST;
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, near],
    [gl.TEXTURE_MAG_FILTER, near],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) {
    gl.texParameteri(gl.TEXTURE_2D, name, value);
  }
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  const depth = deep ? gl.createRenderbuffer() : null;
  if (depth) {
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
  }
  if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE) return { texture, frame, depth };
  freeTarget(gl, { texture, frame, depth });
  return null;
}

/** @param {Gl} gl @param {Target} target */
export function freeTarget(gl, { texture, frame, depth = null }) {
  gl.deleteTexture(texture);
  gl.deleteRenderbuffer(depth);
  gl.deleteFramebuffer(frame);
}

/**
 * Draws a few texels into a format and throws VP7014 if they read back with wrong values.
 * @param {Gl} gl @param {import("./device.js").Device} device @param {Format} format @param {string} name of its shader
 */
export function checkTarget(gl, device, format, name) {
  if (format === "rgba8") return;
  const { probes } = device;
  const key = `drawing into ${format}`;
  let result = probes.found.get(key);
  if (!result) {
    const start = performance.now();
    const trial = TRIALS[format];
    const found = shown(gl, device, format, trial);
    result = {
      works: Math.abs(found - 255 * trial.expected) <= TOLERANCE,
      found: (found / 255).toFixed(3),
      expected: trial.expected.toFixed(3),
    };
    probes.found.set(key, result);
    probes.milliseconds += performance.now() - start;
  }
  if (!result.works) throw new VolpkgError("VP7014", { ...result, format: `${format} (${name})` });
}

/** @param {Gl} gl @param {import("./device.js").Device} device @param {"rgba16f" | "rgba32f"} format @param {typeof TRIALS["rgba16f"]} trial */
function shown(gl, device, format, { value, times, at, from, scale }) {
  const pixel = new Uint8Array(4);
  const programs = [VALUE, SHOWN].map((fragment) => linkNow(gl, "trial", WHOLE, fragment));
  const drawn = makeTarget(gl, format, 2, 1, times > 1);
  device.state(times > 1);
  device.triangle();
  if (drawn) {
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.viewport(0, 0, 1, 1);
    gl.useProgram(programs[0].handle);
    gl.uniform1f(programs[0].locations.u_value, value);
    for (let i = 0; i < times; i++) gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
  const picture = makeTarget(gl, "rgba8", 1, 1, false);
  device.state(false);
  gl.viewport(0, 0, 1, 1);
  gl.useProgram(programs[1].handle);
  gl.bindTexture(gl.TEXTURE_2D, drawn?.texture ?? null);
  gl.uniform3f(programs[1].locations.u_how, at, from, scale);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  for (const value of [drawn, picture]) if (value) freeTarget(gl, value);
  for (const { handle } of programs) gl.deleteProgram(handle);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  device.unbind();
  forgetErrors(gl);
  return pixel[0];
}
