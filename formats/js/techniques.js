/**
 * Pictures that take more than one triangle: slabs of samples, rays that begin at faces of the box, and stacks of layers.
 * SPEC sections 9.1 to 9.3.
 */
import { invert } from "./camera.js";
import { VolpkgError } from "./rarer.js";
import { isWebGl2 } from "./formats.js";
import { layers } from "./layers.js";
import { among, breach, count, tuple } from "./shapes.js";

/** @typedef {import("./choose.js").Value} Value */
/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {import("./program.js").Linked} Linked */
/** @typedef {import("./types.js").Pass} Pass */
/** @typedef {import("./types.js").Program} Program */
/** A pass, and what draws it. @typedef {{pass: Pass, linked: Linked}} Drawing */
/** A texture as large as the picture, and what draws into it. @typedef {Drawing & {texture: WebGLTexture | null, frame: WebGLFramebuffer | null}} Target */
/**
 * How a picture is drawn.
 * @typedef {object} Picture
 * @property {Record<string, Value>} values of uniforms, by their source
 * @property {readonly number[]} viewport x, y, width, height
 * @property {() => void} bindTarget binds what the picture is drawn into
 * @property {(linked: Linked, inputs: import("./load.js").Inputs, values: Record<string, Value>) => void} bind gives a program what it reads
 */

/** Opacities are added. A picture of 8 bits cuts them at 1, as that of the paper does. */
const CLAMPED = "view-slices-as-published";
const KNOWN = ["slabs", "two-pass", "two-pass-as-published", "axis-slices", "view-slices", CLAMPED];
const SQUARE = [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]];
/** Sine of the angle under which a face counts as seen from its edge. */
const EDGE = 1e-6;

const GEOMETRY = among("triangle front-faces back-faces axis-slices view-slices");
const FACTORS = tuple(2, among("ZERO ONE ONE_MINUS_SRC_ALPHA ONE_MINUS_DST_ALPHA"));
/** @type {import("./shapes.js").Shape} */
const PROGRAM = {
  "geometry?": GEOMETRY,
  "before?": [{ geometry: GEOMETRY, target: among("rgba8 rgba32f") }],
  "blend?": { order: among("front-to-back back-to-front"), colour: FACTORS, alpha: FACTORS },
  "slab_samples?": count,
};

/**
 * What draws a program that is no single triangle. Throws VP7021 where this page or device cannot draw its technique.
 * @param {import("./load.js").Wanted} wanted @param {Program} program @param {typeof import("./program.js").checkNamed} checkNamed
 */
export async function loadTechnique({ gl, pack, device, use, signal }, program, checkNamed) {
  const { name, technique = "", before = [] } = program;
  const refuse = (/** @type {string} */ problem) => new VolpkgError("VP7021", { name, technique, problem });
  if (technique === CLAMPED && !isWebGl2(gl)) throw refuse("its opacities pass 1, and must be cut in a picture of 8 bits, which needs WebGL 2");
  if (before.some(({ size }) => size) || program.light_pass) throw refuse("it draws shadows by passes from the light");
  if (!KNOWN.includes(technique)) throw refuse("this reader does not know it");
  const problems = breach(program, PROGRAM, name);
  if (problems) throw new VolpkgError("VP4004", { path: pack.name, problems });
  /** @type {Drawing[]} */
  const passes = [];
  for (const pass of before) {
    if (pass.target === "rgba32f" && !(isWebGl2(gl) && gl.getExtension("EXT_color_buffer_float"))) throw refuse("it needs EXT_color_buffer_float");
    const [vertex, fragment] = [await pack.text(pass.vertex, { signal }), await pack.text(pass.fragment, { signal })];
    const linked = await device.linked(pass.fragment, { name: pass.fragment, vertex, fragment, paths: [pass.vertex, pass.fragment] });
    checkNamed(gl, linked, pass.fragment, pass.uniforms, [], []);
    passes.push({ pass, linked });
  }
  signal.throwIfAborted();
  /** @type {Technique | null} */
  let made = null;
  use(() => (made = new Technique(gl, program, passes, pack.manifest.grid.extent_mm_zyx)));
  return /** @type {Technique | null} */ (made);
}

/** Draws the pictures of one program. */
export class Technique {
  #gl;
  #program;
  #targets;
  #clamped;
  #extent;
  #array;
  #corners;
  #size = "";

  /** @param {Gl} gl @param {Program} program @param {Drawing[]} passes @param {readonly number[]} extent z, y, x */
  constructor(gl, program, passes, extent) {
    this.#gl = gl;
    this.#program = program;
    /** @type {Target[]} */
    this.#targets = passes.map((each) => ({ ...each, texture: null, frame: null }));
    /** What is blended in 8 bits first, if it must be. @type {Target | null} */
    this.#clamped = program.technique === CLAMPED ? /** @type {any} */ ({ pass: { target: "rgba8" }, texture: null, frame: null }) : null;
    this.#extent = [...extent].reverse();
    this.#array = isWebGl2(gl) ? gl.createVertexArray() : null;
    this.#corners = gl.createBuffer();
  }

  /** @param {Linked} linked of the program @param {Picture} picture */
  draw(linked, picture) {
    const gl = this.#gl;
    const { geometry = "triangle", blend, slab_samples: slab, samplers } = this.#program;
    const { values, viewport, bindTarget } = picture;
    const matrix = /** @type {number[]} */ (values.box_from_clip);
    const step = /** @type {number} */ (values.step_mm);
    const all = geometry === "triangle" ? values : { ...values, clip_from_box: clipFromBox(matrix) };
    this.#passes(picture, all, matrix);
    const [x, y, width, height] = viewport;
    const [left, below] = this.#clamped ? [0, 0] : [x, y];
    if (this.#clamped) gl.bindFramebuffer(gl.FRAMEBUFFER, this.#clamped.frame);
    else bindTarget();
    gl.viewport(left, below, width, height);
    this.#clear([left, below, width, height]);
    if (blend) {
      const [sources, alphas] = [blend.colour, blend.alpha];
      gl.enable(gl.BLEND);
      gl.blendEquation(gl.FUNC_ADD);
      gl.blendFuncSeparate(gl[sources[0]], gl[sources[1]], gl[alphas[0]], gl[alphas[1]]);
    }
    if (slab) {
      const samples = Math.ceil(Math.hypot(...this.#extent) / step);
      for (let first = 0; first < samples; first += slab) {
        picture.bind(linked, this.#program, { ...all, first_sample: first });
        this.#read(linked, samplers.length);
        this.#triangles([-1, -1, 3, -1, -1, 3], 2);
      }
    } else if (geometry === "axis-slices" || geometry === "view-slices") {
      const stack = layers(geometry, this.#extent, matrix, step, blend?.order !== "back-to-front");
      picture.bind(linked, this.#program, { ...all, box_from_slices: stack.boxFromSlices, slices: stack.count });
      this.#read(linked, samplers.length);
      this.#triangles(stack.corners, 4);
    } else {
      picture.bind(linked, this.#program, all);
      this.#read(linked, samplers.length);
      this.#triangles(faces(matrix, this.#extent, geometry === "front-faces"), 3);
    }
    gl.disable(gl.BLEND);
    if (!this.#clamped || !isWebGl2(gl)) return;
    bindTarget();
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.#clamped.frame);
    gl.blitFramebuffer(0, 0, width, height, x, y, x + width, y + height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    bindTarget();
  }

  dispose() {
    const gl = this.#gl;
    this.#free();
    gl.deleteBuffer(this.#corners);
    if (isWebGl2(gl)) gl.deleteVertexArray(this.#array);
  }

  /** Draws the passes that come first. @param {Picture} picture @param {Record<string, Value>} values @param {number[]} matrix */
  #passes({ viewport: [, , width, height], bind }, values, matrix) {
    const gl = this.#gl;
    if (this.#size !== `${width} ${height}`) {
      this.#free();
      for (const each of this.#all()) this.#make(each, width, height);
      this.#size = `${width} ${height}`;
    }
    for (const { pass, linked, frame } of this.#targets) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.viewport(0, 0, width, height);
      this.#clear([0, 0, width, height]);
      bind(linked, { uniforms: pass.uniforms, samplers: [] }, values);
      this.#triangles(faces(matrix, this.#extent, pass.geometry === "front-faces"), 3);
    }
  }

  #all() {
    return [...this.#targets, ...(this.#clamped ? [this.#clamped] : [])];
  }

  /** Binds what the passes have drawn, behind the textures of the program. @param {Linked} linked @param {number} unit */
  #read(linked, unit) {
    const gl = this.#gl;
    for (const { pass, texture } of this.#targets) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      if (isWebGl2(gl)) gl.bindSampler(unit, null);
      gl.uniform1i(linked.locations[pass.sampler], unit++);
    }
  }

  /** @param {ArrayLike<number>} corners @param {number} size numbers of a corner */
  #triangles(corners, size) {
    const gl = this.#gl;
    if (isWebGl2(gl)) gl.bindVertexArray(this.#array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#corners);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.STREAM_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, size, gl.FLOAT, false, 0, 0);
    gl.drawArrays(gl.TRIANGLES, 0, corners.length / size);
  }

  /** Clears a part of what is bound. @param {readonly number[]} part */
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
    const gl = this.#gl;
    target.texture = gl.createTexture();
    target.frame = gl.createFramebuffer();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, target.texture);
    const float = target.pass.target === "rgba32f" && isWebGl2(gl);
    gl.texImage2D(gl.TEXTURE_2D, 0, float ? gl.RGBA32F : gl.RGBA, width, height, 0, gl.RGBA, float ? gl.FLOAT : gl.UNSIGNED_BYTE, null);
    for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) {
      gl.texParameteri(gl.TEXTURE_2D, name, value);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target.texture, 0);
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) {
      const { name, technique } = this.#program;
      throw new VolpkgError("VP7021", { name, technique, problem: `nothing can be drawn into ${target.pass.target}` });
    }
  }

  #free() {
    const gl = this.#gl;
    this.#size = "";
    for (const each of this.#all()) {
      gl.deleteTexture(each.texture);
      gl.deleteFramebuffer(each.frame);
      each.texture = each.frame = null;
    }
  }
}

/** With the sign for which w is positive in front of the eye. @param {number[]} boxFromClip */
function clipFromBox(boxFromClip) {
  const sign = boxFromClip[15] < 0 ? -1 : 1;
  return invert(boxFromClip).map((each) => sign * each);
}

/**
 * Corners of two triangles for each face of the box that looks at the viewer, or of the others; 0 or 1 along each axis.
 * @param {number[]} m box from clip @param {readonly number[]} extent x, y, z @param {boolean} front
 */
export function faces(m, extent, front) {
  // Where the matrix of a perspective has its eye; with parallel rays a point at infinity, w = 0.
  let eye = [-m[8], -m[9], -m[10], -m[11]];
  if (Math.abs(eye[3]) * Math.max(...extent) > 1e-9 * Math.hypot(eye[0], eye[1], eye[2])) eye = eye.map((each) => each / eye[3]);
  else {
    const ends = [-1, 1].map((depth) => [0, 1, 2].map((row) => (depth * m[8 + row] + m[12 + row]) / (depth * m[11] + m[15])));
    eye = [...ends[0].map((each, axis) => each - ends[1][axis]), 0];
  }
  const size = Math.hypot(...eye);
  const corners = [];
  for (const axis of [0, 1, 2]) {
    for (const side of [0, 1]) {
      const outside = (eye[axis] - side * extent[axis] * eye[3]) * (side ? 1 : -1);
      // A face that is seen from its edge has no pixels but those of rounding.
      if (Math.abs(outside) <= EDGE * size || outside > 0 !== front) continue;
      for (const square of SQUARE) {
        const others = [...square];
        corners.push(...[0, 1, 2].map((each) => (each === axis ? side : /** @type {number} */ (others.shift()))));
      }
    }
  }
  return corners;
}
