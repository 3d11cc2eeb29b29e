/**
 * Clipping by a box and by planes. Rays are cut where the shader cuts them to the volume: its function clip_to_box gets
 * another one around it, as spec/README.md allows.
 */
import { cutLight } from "./cut_light.js";
import { VolpkgError } from "../core/messages.js";

/**
 * Depth of opaque objects, size of a pixel, and additional planes.
 * @typedef {Partial<import("../core/renderer.js").Depth> & {planes: readonly (readonly number[])[], pixel: readonly number[],
 *   boxFromClip: ArrayLike<number>}} Behind
 */
/**
 * The cuts that an app asks for.
 * @typedef {object} Wanted
 * @property {readonly [low: readonly number[], high: readonly number[]]} [box]
 * @property {readonly (readonly number[])[]} [planes]
 * @property {boolean} [depth]
 */
/**
 * The cuts of a picture, and the code for them in its shaders.
 * @typedef {object} Clip
 * @property {string} key clips with the same key have the same shader text, and differ in values only
 * @property {import("./cut_light.js").CutLight | null} lit the light of the cut volume; null if the package has none
 * @property {readonly (readonly number[])[]} planes x, y, z, offset in box millimetres: everything behind them is cut away
 * @property {string[]} uniforms that clipping adds to the shader
 * @property {(fragment: string, path: string, fromLight?: boolean) => string} shader adds clipping to a fragment
 *   shader; `fromLight` for a pass whose rays come from a light
 * @property {(gl: import("../gl/formats.js").Gl, linked: import("../gl/program.js").Linked, unit: number, behind: Behind) =>
 *   void} bind sets its uniforms, with the first texture unit that is free
 */

const DEFINITION = /\bvec2 clip_to_box\(vec3 origin, vec3 ray\) \{/g;
/** WebGL 1 promises 16 vectors of uniforms to fragment shaders. */
const MOST = 12;

/** A plane that cuts nothing. */
const NO_PLANE = [0, 0, 0, 1];
/** From the depth of a texture to clip coordinates, where that is OpenGL's own. */
const OWN_DEPTH = /** @type {const} */ ([-2, 1, 0]);

/**
 * @param {Wanted} wanted
 * @param {number} more how many planes each picture adds @param {import("../core/types.js").Manifest} manifest
 * @returns {Clip | null} null if nothing is cut away
 */
export function clipOf({ box, planes = [], depth = false, ...others }, more, manifest) {
  const side = (/** @type {number} */ axis, /** @type {number} */ sign, /** @type {number} */ at) =>
    [0, 1, 2, 3].map((c) => sign * (c === axis ? 1 : c === 3 ? -at : 0));
  const isBox = !box || (box.length === 2 && box.every((corner) => corner.length === 3));
  const sides = (box ?? []).flatMap((corner, i) => [0, 1, 2].map((axis) => side(axis, i ? -1 : 1, corner[axis])));
  const own = [...sides, ...planes.map((plane) => [...plane])];
  const count = own.length + more;
  const isSound = isBox && own.every((each) => each.length === 4 && each.every(Number.isFinite));
  if (!isSound || count > MOST || Object.keys(others).length) {
    throw new VolpkgError("VP7019", { what: JSON.stringify({ box, planes, ...others }), limit: MOST - more });
  }
  if (!count && !depth) return null;
  const lit = cutLight(manifest, own, more);
  const of = count ? ["u_clip_planes[0]"] : [];
  const ofDepth = depth ? ["u_clip_depth", "u_clip_pixel", "u_clip_kind", "u_clip_box"] : [];
  return {
    key: `${count} ${depth} ${lit?.cut}`,
    lit,
    planes: own,
    uniforms: [...of, ...ofDepth],
    shader: (fragment, path, fromLight = false) => clipped(fragment, path, count, depth && !fromLight),
    bind(
      gl,
      { locations },
      unit,
      { planes: others, texture, reversed = false, scale = OWN_DEPTH, pixel, boxFromClip },
    ) {
      const all = [...own, ...others.slice(0, more)];
      while (all.length < count) all.push(NO_PLANE);
      if (count) gl.uniform4fv(locations["u_clip_planes[0]"], all.flat());
      if (!depth) return;
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture ?? null);
      gl.uniform1i(locations.u_clip_depth, unit);
      // A texture that is not there reads 0. Nothing is in front where that is the far plane.
      gl.uniform4f(locations.u_clip_pixel, 1 / pixel[0], 1 / pixel[1], texture ? scale[0] : 0, texture ? scale[1] : 1);
      gl.uniform2f(locations.u_clip_kind, reversed ? 0 : 1, scale[2]);
      gl.uniformMatrix4fv(locations.u_clip_box, false, new Float32Array(boxFromClip));
    },
  };
}

/** @param {string} fragment @param {string} path @param {number} count @param {boolean} depth */
function clipped(fragment, path, count, depth) {
  const [before, main, ...more] = fragment.split(MAIN);
  if (before.match(DEFINITION)?.length !== 1 || main === undefined || more.length) {
    throw new VolpkgError("VP7019", {
      what: `${path}, which does not define clip_to_box as the specification says`,
      limit: MOST,
    });
  }
  const read = fragment.startsWith("#version 300 es") ? "texture" : "texture2D";
  // Rays to a light are cut, too, but not where the viewer sees something opaque.
  const both = "vec2 clip_to_box(vec3 origin, vec3 ray);\nvec2 clip_to_volume(vec3 origin, vec3 ray) {";
  const renamed = before.replace(DEFINITION, both);
  const body = depth ? main.replace(/\bclip_to_box\(/g, "clip_to_view(") : main;
  return `${renamed}${count ? PLANES(count) : NOTHING}${depth ? DEPTH(read) : ""}${MAIN}${body}`;
}

const MAIN = "void main() {";
const NOTHING = `vec2 clip_to_box(vec3 origin, vec3 ray) {
  return clip_to_volume(origin, ray);
}

`;
/** @param {number} count */
const PLANES = (count) => `// The visible part of a ray lies on the inner side of each plane, box millimetres.
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
/**
 * Clip coordinates of a pixel. They are linear in what depth lacks to 1; in depth where 1 is the near plane; in the
 * inverse of distance where depth is its logarithm. Differences from 1 keep their digits where the far plane is far.
 * @param {string} read
 */
const DEPTH = (read) => `// A ray ends at opaque objects.
uniform highp sampler2D u_clip_depth;
uniform vec4 u_clip_pixel;
uniform vec2 u_clip_kind;
uniform mat4 u_clip_box;
vec2 clip_to_view(vec3 origin, vec3 ray) {
  vec2 inside = clip_to_box(origin, ray);
  vec2 at = gl_FragCoord.xy * u_clip_pixel.xy;
  float depth = ${read}(u_clip_depth, at).r;
  float near = u_clip_kind.y > 0.0 ? 1.0 / max(exp2(depth * u_clip_kind.y) - 1.0, 1e-30) : abs(u_clip_kind.x - depth);
  vec4 end = u_clip_box * vec4(2.0 * at - 1.0, near * u_clip_pixel.z + u_clip_pixel.w, 1.0);
  return vec2(inside.x, min(inside.y, dot(end.xyz / end.w - origin, ray) / dot(ray, ray)));
}

`;
