/** WebGL programs: compiled, linked, and checked against the manifest. */
import { VolpkgError } from "../core/error.js";
import { passesOf } from "../core/shapes.js";

/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {{handle: WebGLProgram, locations: Record<string, WebGLUniformLocation | null>}} Linked */

/** The vertex shader of passes over the whole picture. */
export const WHOLE = "attribute vec2 a_ndc;\nvoid main() {\n  gl_Position = vec4(a_ndc, 0.0, 1.0);\n}\n";

/** Of corners of the picture, of the box and of layers, and of vertices of meshes. */
const ATTRIBUTES = ["a_ndc", "a_position", "a_corner", "a_slice"];

/** Turns off everything that changes or leaves out pixels. @param {Gl} gl */
export function drawAll(gl) {
  for (const test of [gl.BLEND, gl.DITHER, gl.DEPTH_TEST, gl.STENCIL_TEST, gl.CULL_FACE, gl.SCISSOR_TEST])
    gl.disable(test);
  gl.colorMask(true, true, true, true);
}

/** Forgets earlier errors, so that the next one belongs to the next calls. @param {Gl} gl */
export function forgetErrors(gl) {
  while (gl.getError() !== gl.NO_ERROR && !gl.isContextLost());
}

/** @param {Gl} gl */
export function driverOf(gl) {
  return String(gl.getParameter(gl.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER));
}

/**
 * A program whose attribute 0 is one of ATTRIBUTES. The browser may compile it beside: nothing waits for it here.
 * @param {Gl} gl
 * @param {{name: string, vertex: string, fragment: string, paths?: [vertex: string, fragment: string]}} texts
 * @returns {Promise<Linked>}
 */
export async function link(gl, { name, vertex, fragment, paths = ["vertex shader", "fragment shader"] }) {
  const handle = begin(gl, vertex, fragment);
  const parallel = gl.getExtension("KHR_parallel_shader_compile");
  while (parallel && !gl.isContextLost() && !gl.getProgramParameter(handle, parallel.COMPLETION_STATUS_KHR)) {
    await new Promise((resolve) => setTimeout(resolve, 2));
  }
  return end(gl, handle, name, paths);
}

/** As `link`, at once. @param {Gl} gl @param {string} name @param {string} vertex @param {string} fragment */
export function linkNow(gl, name, vertex, fragment) {
  return end(gl, begin(gl, vertex, fragment), name, ["vertex shader", "fragment shader"]);
}

/** @param {Gl} gl @param {string} vertex @param {string} fragment @returns {WebGLProgram} */
function begin(gl, vertex, fragment) {
  const handle = gl.createProgram();
  for (const [kind, text] of /** @type {const} */ ([
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ])) {
    const shader = gl.createShader(kind);
    if (!shader || !handle) throw new VolpkgError("VP7018", { problem: "the context is lost" });
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(handle, shader);
  }
  for (const name of ATTRIBUTES) gl.bindAttribLocation(handle, 0, name);
  gl.linkProgram(handle);
  return /** @type {WebGLProgram} */ (handle);
}

/** @param {Gl} gl @param {WebGLProgram} handle @param {string} name @param {[string, string]} paths @returns {Linked} */
function end(gl, handle, name, paths) {
  const shaders = gl.getAttachedShaders(handle) ?? [];
  const linked = gl.getProgramParameter(handle, gl.LINK_STATUS);
  const logs = shaders.map((shader) =>
    gl.getShaderParameter(shader, gl.COMPILE_STATUS) ? "" : ` ${gl.getShaderInfoLog(shader)}`,
  );
  const log = ` ${gl.getProgramInfoLog(handle)}`;
  for (const shader of shaders) gl.deleteShader(shader);
  if (!linked) {
    gl.deleteProgram(handle);
    if (gl.isContextLost()) throw new VolpkgError("VP7018", { problem: "the context is lost" });
    const broken = logs.findIndex(Boolean);
    if (broken >= 0) throw new VolpkgError("VP5005", { path: paths[broken], driver: driverOf(gl), log: logs[broken] });
    throw new VolpkgError("VP5006", { name, paths: paths.join(", "), driver: driverOf(gl), log });
  }
  /** @type {Linked["locations"]} */
  const locations = {};
  for (const each of active(gl, handle)) locations[each.name] = gl.getUniformLocation(handle, each.name);
  return { handle, locations };
}

/** @param {Gl} gl @param {WebGLProgram} handle @returns {WebGLActiveInfo[]} */
function active(gl, handle) {
  const count = gl.getProgramParameter(handle, gl.ACTIVE_UNIFORMS);
  return Array.from({ length: count }, (_, i) => /** @type {WebGLActiveInfo} */ (gl.getActiveUniform(handle, i)));
}

/**
 * Throws unless a program uses exactly the inputs in the manifest and those added by this reader.
 * @param {Gl} gl @param {Linked} linked @param {import("../core/types.js").Program} program
 * @param {import("../core/types.js").Texture[]} textures @param {string[]} added
 */
export function checkUniforms(gl, linked, program, textures, added) {
  const samplers = program.samplers.map(
    (name, i) => `${name} ${textures[i].gl.target === "TEXTURE_3D" ? 0x8b5f : gl.SAMPLER_2D}`,
  );
  const before = passesOf(program).map(({ sampler }) => `${sampler} ${gl.SAMPLER_2D}`);
  checkNamed(gl, linked, program.name, program.uniforms, [...samplers, ...before], added);
}

/**
 * Throws unless a program uses exactly the named attributes, uniforms and samplers.
 * @param {Gl} gl @param {Linked} linked @param {string} program its name @param {import("../core/types.js").Uniform[]} uniforms
 * @param {string[]} samplers with their types @param {string[]} added
 */
export function checkNamed(gl, linked, program, uniforms, samplers, added) {
  const kinds = { f32: gl.FLOAT, vec3f: gl.FLOAT_VEC3, mat4x4f: gl.FLOAT_MAT4 };
  const named = [...uniforms.map(({ name, type }) => `${name} ${kinds[type]}`), ...samplers].sort();
  const found = active(gl, linked.handle)
    .filter(({ name }) => !added.includes(name))
    .map(({ name, type }) => `${name} ${type}`)
    .sort();
  if (named.join() !== found.join())
    throw new VolpkgError("VP5017", { name: program, named: named.join(", "), found: found.join(", ") });
}

/** Sets a uniform by the number of its values. @param {Gl} gl @param {WebGLUniformLocation | null} at @param {number | readonly number[]} value */
export function setUniform(gl, at, value) {
  if (typeof value === "number") gl.uniform1f(at, value);
  else if (value.length === 16) gl.uniformMatrix4fv(at, false, new Float32Array(value));
  else if (value.length === 3) gl.uniform3fv(at, new Float32Array(value));
  else gl.uniform4fv(at, new Float32Array(value));
}
