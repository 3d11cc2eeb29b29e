/**
 * Pictures that take more than one triangle: slabs of samples, rays that begin at faces of the box, stacks of layers,
 * passes from the light, and rays that begin and end at a mesh. spec/passes.md and spec/proxy.md.
 */
import { check } from "../core/abort.js";
import { invert } from "../camera.js";
import { VolpkgError } from "../core/messages.js";
import { isWebGl2 } from "../gl/formats.js";
import { layers } from "./layers.js";
import { TEXEL_BYTES, checkTarget, claims, freeTarget, makeTarget } from "../gl/pass_targets.js";
import { among, breach, count, passesOf, text, tuple } from "../core/shapes.js";

/** @typedef {import("../core/drawing.js").Value} Value */
/** @typedef {import("../gl/formats.js").Gl} Gl */
/** @typedef {import("../gl/program.js").Linked} Linked */
/** @typedef {import("../core/types.js").Blend} Blend */
/** @typedef {import("../core/types.js").LightPass} LightPass */
/** @typedef {import("../core/types.js").Pass} Pass */
/** @typedef {import("../core/types.js").Program} Program */
/** A pass, and the program that draws it. @typedef {{pass: Pass, linked: Linked}} Drawing */
/**
 * A pass with its texture and framebuffer.
 * @typedef {Drawing & import("../gl/pass_targets.js").Target} Target
 */
/**
 * How a picture is drawn.
 * @typedef {object} Picture
 * @property {Record<string, Value>} values of uniforms, by their source
 * @property {readonly number[]} viewport x, y, width, height
 * @property {readonly number[]} [part] of the viewport, which is drawn
 * @property {() => void} bindTarget binds the target of the picture
 * @property {(linked: Linked, inputs: import("../core/load.js").Inputs, values: Record<string, Value>) => void} bind binds
 *   the inputs of a program
 */

/** Opacities are added. A picture of 8 bits cuts them at 1, as that of the paper does. */
const CLAMPED = "view-slices-as-published";
const KNOWN = [
  "ray-casting",
  "ray-casting-as-published",
  "slabs",
  "tiles",
  "two-pass",
  "two-pass-as-published",
  "axis-slices",
  "view-slices",
  CLAMPED,
];
/** The triangle that covers the picture. */
const WHOLE = [-1, -1, 3, -1, -1, 3];
const SAMPLER_3D = 0x8b5f;
const SQUARE = [
  [0, 0],
  [1, 0],
  [1, 1],
  [0, 0],
  [1, 1],
  [0, 1],
];
/** Sine of the angle under which a face counts as seen from its edge. */
const EDGE = 1e-6;

const GEOMETRY = among("triangle front-faces back-faces axis-slices view-slices half-angle-slices");
const FACTORS = tuple(2, among("ZERO ONE ONE_MINUS_SRC_ALPHA ONE_MINUS_DST_ALPHA"));
const BLEND = { order: among("front-to-back back-to-front"), colour: FACTORS, alpha: FACTORS };
const PASS = {
  geometry: among("triangle front-faces back-faces view-slices half-angle-slices mesh"),
  target: among("rgba8 rgba16f rgba32f"),
  "reads?": [text],
  "size?": count,
};
/** @type {import("../core/shapes.js").Shape} */
const PROGRAM = {
  "geometry?": GEOMETRY,
  "before?": [PASS],
  "light_pass?": { ...PASS, size: count, blend: BLEND, behind: BLEND },
  "blend?": BLEND,
  "slab_samples?": count,
};

/**
 * Loads a technique that takes more than one triangle. Throws VP7021 if this page or device cannot draw the technique,
 * and VP7011 to VP7014 if it cannot draw into the targets of the passes.
 * @param {import("../core/load.js").Wanted} wanted
 * @param {Pick<import("../core/drawing.js").Choice, "program" | "textures" | "level">} choice
 * @param {typeof import("../gl/program.js").checkNamed} checkNamed
 * @param {import("../gl/mesh.js").Shape | null} [mesh] where its rays begin and end
 */
export async function loadTechnique(
  { gl, pack, device, clip, maxTextureBytes: limit = pack.manifest.profile.max_texture_bytes, use, signal },
  { program, textures, level },
  checkNamed,
  mesh = null,
) {
  const { name, technique = "ray-casting", samplers } = program;
  const refuse = (/** @type {string} */ problem) => new VolpkgError("VP7021", { name, technique, problem });
  if (technique === CLAMPED && !isWebGl2(gl))
    throw refuse("its opacities pass 1, and must be cut in a picture of 8 bits, which needs WebGL 2");
  if (!KNOWN.includes(technique)) throw refuse("this reader does not know it");
  const problems = breach(program, PROGRAM, name);
  if (!mesh && passesOf(program).some(({ geometry }) => geometry === "mesh"))
    throw refuse("it draws a mesh, and has none");
  if (problems) throw new VolpkgError("VP4004", { path: pack.name, problems });
  /** @type {Drawing[]} */
  const passes = [];
  for (const pass of passesOf(program)) {
    const { size = 0, target } = pass;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const bytes = size * size * TEXEL_BYTES[target];
    if (size > most) throw new VolpkgError("VP7011", { name: pass.fragment, axis: "width", size, limit: most });
    if (bytes > limit) throw new VolpkgError("VP7013", { level: level.index, size: bytes, limit });
    if (!claims(gl, target)) throw refuse("it needs EXT_color_buffer_float");
    use(() => checkTarget(gl, device, target, pass.fragment));
    const paths = /** @type {[string, string]} */ ([pass.vertex, pass.fragment]);
    const linked = await device.linked(`${pass.fragment} ${clip?.key ?? ""}`, async () => {
      const [vertex, fragment] = await Promise.all(paths.map((path) => pack.text(path, { signal })));
      // Clipped parts cast no shadow.
      const cut = (size && clip?.shader(fragment, pass.fragment, true)) || fragment;
      return { name: pass.fragment, vertex, fragment: cut, paths };
    });
    const kind = (/** @type {number} */ i) => (textures[i].gl.target === "TEXTURE_3D" ? SAMPLER_3D : gl.SAMPLER_2D);
    const read = samplers.flatMap((each, i) => (pass.reads?.includes(each) ? [`${each} ${kind(i)}`] : []));
    checkNamed(gl, linked, pass.fragment, pass.uniforms, read, clip?.uniforms ?? []);
    passes.push({ pass, linked });
  }
  if (program.light_pass && program.light?.shadows !== "half-angle")
    throw refuse("it has no light that casts such shadows");
  const stack = program.light_pass ? (await import("./half_angle.js")).halfAngleLayers : null;
  check(signal);
  /** @type {Technique | null} */
  let made = null;
  // Pictures on a grid of their own have one technique, ray casting.
  use(() => (made = new Technique(gl, program, passes, pack.manifest.grid.extent_mm_zyx, stack, mesh)));
  return /** @type {Technique | null} */ (made);
}

/** Draws the pictures of one program. */
export class Technique {
  #gl;
  #program;
  #targets;
  #clamped;
  #extent;
  #halfAngle;
  #mesh;
  #array;
  #corners;
  #size = "";
  /** Inputs of the last shadow map. */
  #lit = "";

  /**
   * @param {Gl} gl @param {Program} program @param {Drawing[]} passes @param {readonly number[]} extent z, y, x
   * @param {typeof import("./half_angle.js").halfAngleLayers | null} halfAngle
   * @param {import("../gl/mesh.js").Shape | null} mesh
   */
  constructor(gl, program, passes, extent, halfAngle, mesh) {
    this.#gl = gl;
    this.#program = program;
    /** @type {Target[]} */
    this.#targets = passes.map((pass) => ({ ...pass, texture: null, frame: null }));
    /** Intermediate target for blending in 8 bits, if needed. @type {Target | null} */
    this.#clamped =
      program.technique === CLAMPED
        ? /** @type {any} */ ({ pass: { target: "rgba8" }, texture: null, frame: null })
        : null;
    this.#extent = [...extent].reverse();
    this.#halfAngle = halfAngle;
    this.#mesh = mesh;
    this.#array = isWebGl2(gl) ? gl.createVertexArray() : null;
    this.#corners = gl.createBuffer();
  }

  /** @param {Linked} linked of the program @param {Picture} picture */
  draw(linked, picture) {
    const gl = this.#gl;
    const { geometry = "triangle", blend, slab_samples: slab, samplers, light_pass: light } = this.#program;
    const { values, viewport, bindTarget, part } = picture;
    const matrix = /** @type {number[]} */ (values.box_from_clip);
    const step = /** @type {number} */ (values.step_mm);
    const all = geometry === "triangle" && !this.#mesh ? values : { ...values, clip_from_box: clipFromBox(matrix) };
    this.#passes(picture, all, matrix);
    const [x, y, width, height] = viewport;
    const place = /** @type {const} */ ([...(this.#clamped ? [0, 0] : [x, y]), width, height]);
    if (this.#clamped) gl.bindFramebuffer(gl.FRAMEBUFFER, this.#clamped.frame);
    else bindTarget();
    gl.viewport(place[0], place[1], width, height);
    this.#clear(part ?? place);
    if (part) gl.enable(gl.SCISSOR_TEST);
    if (blend) this.#blend(blend);
    if (light) this.#layers(linked, picture, all, light);
    else if (slab) {
      const samples = Math.ceil(Math.hypot(...this.#extent) / step);
      for (let first = 0; first < samples; first += slab) {
        picture.bind(linked, this.#program, { ...all, first_sample: first });
        this.#read(linked, samplers.length);
        this.#triangles(WHOLE, 2);
      }
    } else if (geometry === "axis-slices" || geometry === "view-slices") {
      const stack = layers(geometry, this.#extent, matrix, step, blend?.order !== "back-to-front");
      picture.bind(linked, this.#program, { ...all, box_from_slices: stack.boxFromSlices, slices: stack.count });
      this.#read(linked, samplers.length);
      this.#triangles(stack.corners, 4);
    } else {
      picture.bind(linked, this.#program, all);
      this.#read(linked, samplers.length);
      this.#shape(geometry, matrix);
    }
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
    if (!this.#clamped || !isWebGl2(gl)) return;
    bindTarget();
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.#clamped.frame);
    gl.blitFramebuffer(0, 0, width, height, x, y, x + width, y + height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    bindTarget();
  }

  /** Redraws everything kept between pictures, because the clip changed. */
  renew() {
    this.#lit = "";
  }

  dispose() {
    const gl = this.#gl;
    this.#free();
    gl.deleteBuffer(this.#corners);
    if (isWebGl2(gl)) gl.deleteVertexArray(this.#array);
  }

  /**
   * Draws the passes that come first.
   * @param {Picture} picture
   * @param {Record<string, Value>} values
   * @param {number[]} matrix
   */
  #passes({ viewport: [, , width, height], bind }, values, matrix) {
    const gl = this.#gl;
    if (this.#size !== `${width} ${height}`) {
      this.#free();
      for (const each of this.#all()) this.#make(each, each.pass.size ?? width, each.pass.size ?? height);
      this.#size = `${width} ${height}`;
    }
    for (const { pass, linked, frame } of this.#targets) {
      const [wide, high] = [pass.size ?? width, pass.size ?? height];
      const lit = `${values.step_mm} ${values.light_mm}`;
      // A shadow map is the same for every view. Half-angle slices draw their pass themselves.
      if (pass === this.#program.light_pass || (pass.size && this.#lit === lit)) continue;
      if (pass.size) this.#lit = lit;
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.viewport(0, 0, wide, high);
      this.#clear([0, 0, wide, high]);
      bind(linked, { uniforms: pass.uniforms, samplers: this.#program.samplers }, values);
      if (pass.geometry === "mesh") this.#mesh?.draw();
      else this.#shape(pass.geometry, matrix);
    }
  }

  /**
   * Draws each layer for the viewer, then for the light.
   * @param {Linked} linked @param {Picture} picture @param {Record<string, Value>} values @param {LightPass} light
   */
  #layers(linked, { viewport: [x, y, width, height], bind }, values, light) {
    const gl = this.#gl;
    const {
      box_from_clip: matrix,
      light_mm: place,
      box_from_light: view,
    } = /** @type {Record<string, number[]>} */ (values);
    const { name, technique = "view-slices" } = this.#program;
    if (!view) throw new VolpkgError("VP7021", { name, technique, problem: "its light is in the volume" });
    const stack = /** @type {typeof import("./half_angle.js").halfAngleLayers} */ (this.#halfAngle)(
      this.#extent,
      matrix,
      place,
      view,
      /** @type {number} */ (values.step_mm),
    );
    const all = { ...values, box_from_slices: stack.boxFromSlices, slices: stack.count };
    const picture = gl.getParameter(gl.FRAMEBUFFER_BINDING);
    const pass = /** @type {Target} */ (this.#targets[this.#targets.length - 1]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, pass.frame);
    this.#clear([0, 0, light.size, light.size]);
    // Both read the same textures from the same units.
    bind(pass.linked, { uniforms: light.uniforms, samplers: this.#program.samplers }, all);
    bind(linked, this.#program, all);
    this.#read(linked, this.#program.samplers.length);
    this.#fill([...stack.seen, ...stack.lit].flat(), 4);
    let first = 0;
    const firsts = [...stack.seen, ...stack.lit].map(({ length }) => (first += length / 4) - length / 4);
    const draw = (/** @type {number} */ at, /** @type {number[]} */ corners) =>
      corners.length && gl.drawArrays(gl.TRIANGLES, firsts[at], corners.length / 4);
    for (let n = 0; n < stack.count; n++) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, picture);
      gl.viewport(x, y, width, height);
      gl.useProgram(linked.handle);
      this.#blend(stack.behind ? light.behind : /** @type {Blend} */ (this.#program.blend));
      draw(n, stack.seen[n]);
      gl.bindFramebuffer(gl.FRAMEBUFFER, pass.frame);
      gl.viewport(0, 0, light.size, light.size);
      gl.useProgram(pass.linked.handle);
      this.#blend(light.blend);
      draw(stack.count + n, stack.lit[n]);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, picture);
  }

  #all() {
    return [...this.#targets, ...(this.#clamped ? [this.#clamped] : [])];
  }

  /** @param {Blend} blend */
  #blend({ colour, alpha }) {
    const gl = this.#gl;
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.FUNC_ADD);
    gl.blendFuncSeparate(gl[colour[0]], gl[colour[1]], gl[alpha[0]], gl[alpha[1]]);
  }

  /**
   * Binds the results of the passes, after the textures of the program.
   * @param {Linked} linked
   * @param {number} unit
   */
  #read(linked, unit) {
    const gl = this.#gl;
    for (const { pass, texture } of this.#targets) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      if (isWebGl2(gl)) gl.bindSampler(unit, null);
      gl.uniform1i(linked.locations[pass.sampler], unit++);
    }
  }

  /**
   * Draws the triangle, or faces of the box.
   * @param {import("../core/types.js").Geometry} geometry
   * @param {number[]} matrix
   */
  #shape(geometry, matrix) {
    if (geometry === "triangle") this.#triangles(WHOLE, 2);
    else this.#triangles(faces(matrix, this.#extent, geometry === "front-faces"), 3);
  }

  /** @param {ArrayLike<number>} corners @param {number} size numbers of a corner */
  #triangles(corners, size) {
    this.#fill(corners, size);
    this.#gl.drawArrays(this.#gl.TRIANGLES, 0, corners.length / size);
  }

  /** Sets the corners to draw. @param {ArrayLike<number>} corners @param {number} size numbers of a corner */
  #fill(corners, size) {
    const gl = this.#gl;
    if (isWebGl2(gl)) gl.bindVertexArray(this.#array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#corners);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.STREAM_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, size, gl.FLOAT, false, 0, 0);
  }

  /** Clears a part of the bound target. @param {readonly number[]} part */
  #clear([x, y, width, height]) {
    const gl = this.#gl;
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(x, y, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.SCISSOR_TEST);
  }

  /** @param {Target} target @param {number} width @param {number} height */
  #make(target, width, height) {
    const { name, technique, light_pass: light } = this.#program;
    const made = makeTarget(
      this.#gl,
      target.pass.target,
      width,
      height,
      target.pass === light,
      target.pass.geometry === "mesh",
    );
    if (!made)
      throw new VolpkgError("VP7021", { name, technique, problem: `nothing can be drawn into ${target.pass.target}` });
    Object.assign(target, made);
  }

  #free() {
    this.#size = this.#lit = "";
    for (const each of this.#all()) {
      freeTarget(this.#gl, each);
      each.texture = each.frame = each.depth = null;
    }
  }
}

/** With the sign for which w is positive in front of the eye. @param {number[]} boxFromClip */
function clipFromBox(boxFromClip) {
  const sign = boxFromClip[15] < 0 ? -1 : 1;
  return invert(boxFromClip).map((x) => sign * x);
}

/**
 * Corners of two triangles for each face of the box that looks at the viewer, or of the others; 0 or 1 along each axis.
 * @param {number[]} m box from clip @param {readonly number[]} extent x, y, z @param {boolean} front
 */
export function faces(m, extent, front) {
  // Where the matrix of a perspective has its eye; with parallel rays a point at infinity, w = 0.
  let eye = [-m[8], -m[9], -m[10], -m[11]];
  if (Math.abs(eye[3]) * Math.max(...extent) > 1e-9 * Math.hypot(eye[0], eye[1], eye[2]))
    eye = eye.map((x) => x / eye[3]);
  else {
    const ends = [-1, 1].map((depth) =>
      [0, 1, 2].map((row) => (depth * m[8 + row] + m[12 + row]) / (depth * m[11] + m[15])),
    );
    eye = [...ends[0].map((each, axis) => each - ends[1][axis]), 0];
  }
  const size = Math.hypot(...eye);
  const corners = [];
  for (const axis of [0, 1, 2]) {
    for (const side of [0, 1]) {
      const outside = (eye[axis] - side * extent[axis] * eye[3]) * (side ? 1 : -1);
      // A face seen edge-on has no pixels except by rounding.
      if (Math.abs(outside) <= EDGE * size || outside > 0 !== front) continue;
      for (const square of SQUARE) {
        const others = [...square];
        corners.push(...[0, 1, 2].map((value) => (value === axis ? side : /** @type {number} */ (others.shift()))));
      }
    }
  }
  return corners;
}
