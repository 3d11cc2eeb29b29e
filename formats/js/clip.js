/**
 * Clipping by a box and by planes. Rays are cut where the shader cuts them to the volume: its function clip_to_box gets
 * another one around it, as SPEC section 9 allows.
 */
import { VolpkgError } from "./rarer.js";

/** Depth of what is opaque, in a picture of so many pixels. @typedef {{texture: WebGLTexture, reversed?: boolean, pixel: number[], boxFromClip: ArrayLike<number>}} Behind */
/**
 * What is cut away, and how a shader does it.
 * @typedef {object} Clip
 * @property {number[][]} planes
 * @property {boolean} depth whether rays end at what is opaque
 * @property {string[]} uniforms that the shader has beside those of the manifest
 * @property {(fragment: string, path: string, fromLight?: boolean) => string} shader with `fromLight` that of a pass, whose rays come from a light
 * @property {(gl: import("./formats.js").Gl, linked: import("./program.js").Linked, unit: number, behind: Behind | null) => void} bind
 *   sets its uniforms, with the first texture unit that is free
 */

const DEFINITION = /\bvec2 clip_to_box\(vec3 origin, vec3 ray\) \{/g;
/** WebGL 1 promises 16 vectors of uniforms to fragment shaders. */
const MOST = 12;

/**
 * @param {{box?: readonly [low: readonly number[], high: readonly number[]], planes?: readonly (readonly number[])[], depth?: boolean}} wanted
 * @returns {Clip | null} null if nothing is cut away
 */
export function clipOf({ box, planes = [], depth = false }) {
  const sides = (box ?? []).flatMap((corner, i) => [0, 1, 2].map((axis) => [0, 1, 2, 3].map((c) => (i ? -1 : 1) * (c === axis ? 1 : c === 3 ? -corner[axis] : 0))));
  const all = [...sides, ...planes.map((each) => [...each])];
  if (all.length > MOST || all.some((each) => each.length !== 4 || !each.every(Number.isFinite))) {
    throw new VolpkgError("VP7019", { what: JSON.stringify({ box, planes }), limit: box ? MOST - 6 : MOST });
  }
  if (!all.length && !depth) return null;
  const uniforms = [...(all.length ? ["u_clip_planes[0]"] : []), ...(depth ? ["u_clip_depth", "u_clip_pixel", "u_clip_box"] : [])];
  return {
    planes: all,
    depth,
    uniforms,
    shader: (fragment, path, fromLight = false) => clipped(fragment, path, all.length, depth && !fromLight),
    bind(gl, { locations }, unit, behind) {
      if (all.length) gl.uniform4fv(locations["u_clip_planes[0]"], all.flat());
      if (!depth || !behind) return;
      const { texture, reversed, pixel, boxFromClip } = behind;
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(locations.u_clip_depth, unit);
      gl.uniform4f(locations.u_clip_pixel, 1 / pixel[0], 1 / pixel[1], reversed ? -2 : 2, reversed ? 1 : -1);
      gl.uniformMatrix4fv(locations.u_clip_box, false, new Float32Array(boxFromClip));
    },
  };
}

/** @param {string} fragment @param {string} path @param {number} count @param {boolean} depth */
function clipped(fragment, path, count, depth) {
  const [before, main, ...more] = fragment.split(MAIN);
  if (before.match(DEFINITION)?.length !== 1 || main === undefined || more.length) {
    throw new VolpkgError("VP7019", { what: `${path}, which does not define clip_to_box as SPEC.md says`, limit: MOST });
  }
  const read = fragment.startsWith("#version 300 es") ? "texture" : "texture2D";
  // Rays to a light are cut, too, but not where the viewer sees something opaque.
  const renamed = before.replace(DEFINITION, "vec2 clip_to_box(vec3 origin, vec3 ray);\nvec2 clip_to_volume(vec3 origin, vec3 ray) {");
  const body = depth ? main.replace(/\bclip_to_box\(/g, "clip_to_view(") : main;
  return `${renamed}${count ? PLANES(count) : NOTHING}${depth ? DEPTH(read) : ""}${MAIN}${body}`;
}

const MAIN = "void main() {";
const NOTHING = `vec2 clip_to_box(vec3 origin, vec3 ray) {
  return clip_to_volume(origin, ray);
}

`;
/** @param {number} count */
const PLANES = (count) => `// What is seen of a ray lies on the inner side of each plane, box millimetres.
uniform vec4 u_clip_planes[${count}];
vec2 clip_to_box(vec3 origin, vec3 ray) {
  vec2 inside = clip_to_volume(origin, ray);
  for (int i = 0; i < ${count}; i++) {
    float at = dot(u_clip_planes[i].xyz, origin) + u_clip_planes[i].w;
    float slope = dot(u_clip_planes[i].xyz, ray);
    if (slope > 0.0) {
      inside.x = max(inside.x, min(-at / slope, 1.0));
    } else if (slope < 0.0) {
      inside.y = min(inside.y, max(-at / slope, 0.0));
    } else if (at < 0.0) {
      inside.y = 0.0;
    }
  }
  return inside;
}

`;
/** Clip coordinates of a pixel: u_clip_pixel scales depth from 0 at the near plane to -1. @param {string} read */
const DEPTH = (read) => `// A ray ends at what is opaque.
uniform highp sampler2D u_clip_depth;
uniform vec4 u_clip_pixel;
uniform mat4 u_clip_box;
vec2 clip_to_view(vec3 origin, vec3 ray) {
  vec2 inside = clip_to_box(origin, ray);
  vec2 at = gl_FragCoord.xy * u_clip_pixel.xy;
  vec4 end = u_clip_box * vec4(2.0 * at - 1.0, ${read}(u_clip_depth, at).r * u_clip_pixel.z + u_clip_pixel.w, 1.0);
  return vec2(inside.x, min(inside.y, dot(end.xyz / end.w - origin, ray) / dot(ray, ray)));
}

`;
