/**
 * Draws the paletted slices of a package for OpenGL ES 1.1 with WebGL 1, from the same stacks: spec/es11.md.
 *
 * WebGL has no paletted textures: indices and palette are two textures here. So an edit of a transfer function uploads
 * the palette alone, 1 kB for each stack (Moser and Weiskopf 2008, section 4). Colours are looked up before they are
 * filtered, as fixed functions do it.
 */
import { invert, moved } from "../runtime/camera.js";
import { checkEdit, round, sampled } from "../runtime/edit.js";
import { WHOLE, linkNow } from "../runtime/program.js";

/** @typedef {import("../runtime/volpkg.js").Package} Package */
/** @typedef {"x" | "y" | "z"} Axis */

const PALETTE_BYTES = 1024;
const AXES = /** @type {const} */ (["x", "y", "z"]);
/** Axes (0 to 2 for x to z) of the columns and the rows of a slice. */
const ACROSS = /** @type {const} */ ({ x: [1, 2], y: [0, 2], z: [0, 1] });
const MOST_BRIGHTNESS = 2;
/** Cosines of stacks that differ by less count as equal: the first of x, y, z is drawn. */
const TIE = 1e-9;

const VERTEX = `attribute vec3 a_position;
attribute vec2 a_texel;
uniform mat4 clip_from_box;
varying vec2 v_texel;
void main() {
  v_texel = a_texel;
  gl_Position = clip_from_box * vec4(a_position, 1.0);
}`;
const FRAGMENT = `precision highp float;
uniform sampler2D indices;
uniform sampler2D next_indices;
uniform sampler2D palette;
uniform vec2 slice_size;
uniform vec4 tile;
uniform vec4 next_tile;
uniform float next_share;
uniform float factor;
varying vec2 v_texel;
// The colour of a texel of a slice; a tile is its first texel and the size of its texture.
vec4 colour(sampler2D from, vec4 tile, vec2 texel) {
  float index = texture2D(from, (tile.xy + texel + 0.5) / tile.zw).r * 255.0;
  return texture2D(palette, vec2((index + 0.5) / 256.0, 0.5));
}
vec4 filtered(sampler2D from, vec4 tile) {
  vec2 at = clamp(v_texel, vec2(0.5), slice_size - 0.5) - 0.5;
  vec2 low = floor(at), share = at - low, high = min(low + 1.0, slice_size - 1.0);
  vec4 lower = mix(colour(from, tile, low), colour(from, tile, vec2(high.x, low.y)), share.x);
  vec4 upper = mix(colour(from, tile, vec2(low.x, high.y)), colour(from, tile, high), share.x);
  return mix(lower, upper, share.y);
}
void main() {
  vec4 seen = filtered(indices, tile);
  if (next_share > 0.0) seen = mix(seen, filtered(next_indices, next_tile), next_share);
  gl_FragColor = min(factor * seen, 1.0);
}`;
const SHOWN = `precision highp float;
uniform sampler2D picture;
uniform vec2 size;
uniform vec3 background;
void main() {
  vec4 seen = texture2D(picture, gl_FragCoord.xy / size);
  vec3 light = seen.rgb + (1.0 - seen.a) * background;
  gl_FragColor = vec4(mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light)), 1.0);
}`;

/**
 * One texture of a stack on the device.
 * @typedef {{layout: any, size: number[], distance: number, indices: WebGLTexture, palette: WebGLTexture, largest: number}} Part
 */
/** A slice, and its tile. @typedef {{part: Part, tile: number[]}} Slice */
/** A polygon between two slices: its place along the axis, and the share of the second one. @typedef {{place: number, slice: Slice, next: Slice, share: number}} Polygon */

/** Draws the slices of one transfer function at a time. */
export class SliceRenderer {
  #gl;
  #pack;
  #slices;
  #shown;
  #corners;
  #square;
  /** @type {Part[]} */
  #parts = [];
  /** Points of edited functions, by name. @type {Map<string, any>} */
  #edits = new Map();
  #target;
  #size = [0, 0];
  /** Transfer function that is drawn. */
  program = "";
  /** Bytes that the last edit uploaded. */
  edited = 0;
  /** Words for people. @type {string[]} */
  notes = [];
  ready = Promise.resolve();
  onchange = () => {};

  /** @param {WebGLRenderingContext} gl @param {Package} pack */
  constructor(gl, pack) {
    this.#gl = gl;
    this.#pack = pack;
    this.#slices = linkNow(gl, "slices", VERTEX, FRAGMENT);
    this.#shown = linkNow(gl, "shown slices", WHOLE, SHOWN);
    this.#corners = buffer(gl, gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]));
    this.#square = buffer(gl, gl.ARRAY_BUFFER, new Float32Array(0));
    this.#target = { frame: gl.createFramebuffer(), texture: texture(gl, gl.RGBA, 1, 1, null) };
  }

  /** The package that is drawn. */
  get package() {
    return this.#pack;
  }

  /** Pictures that can be drawn. */
  get programs() {
    return this.#pack.transferFunctions.map(({ name }) => ({ name }));
  }

  /** The level that is drawn: slices hold one. */
  get level() {
    return this.#pack.levels[0].index;
  }

  get grid() {
    return this.#pack.levels[0].grid;
  }

  /** Draws another transfer function. @param {string} name */
  async setProgram(name) {
    const wanted = this.#pack.manifest.textures.filter(
      (texture) => texture.role === "slices" && texture.transfer === name,
    );
    const made = [];
    for (const each of wanted.sort((a, b) => (a.part ?? 0) - (b.part ?? 0)))
      made.push(this.#part(each, await this.#pack.read(each.file)));
    this.#free();
    this.#parts = made;
    this.program = name;
    this.#recolour();
  }

  /** Draws an edited function in place of `name`; null takes the edit back. @param {any} edit @param {string} name */
  async setTransfer(edit, name) {
    if (edit) this.#edits.set(name, checkEdit(this.#pack, edit, name));
    else this.#edits.delete(name);
    if (name === this.program) this.#recolour();
  }

  /** Slices are always drawn whole. */
  interacting() {}

  /** @param {{boxFromClip: number[]}} view */
  draw({ boxFromClip }) {
    const gl = this.#gl;
    this.#begin();
    const { axis, cosine } = this.#facing(boxFromClip);
    const parts = this.#parts.filter((part) => part.layout.axis === axis);
    const factor = Math.min(
      1 / Math.max(cosine, 1e-6),
      1 / Math.max(...parts.map((part) => part.largest)),
      MOST_BRIGHTNESS,
    );
    const { handle, locations } = this.#slices;
    gl.useProgram(handle);
    gl.uniformMatrix4fv(locations.clip_from_box, false, new Float32Array(invert(boxFromClip)));
    gl.uniform1i(locations.indices, 0);
    gl.uniform1i(locations.palette, 1);
    gl.uniform1i(locations.next_indices, 2);
    gl.uniform1f(locations.factor, factor);
    const [rows, columns] = parts[0].layout.slice_shape_yx;
    gl.uniform2f(locations.slice_size, columns, rows);
    bind(gl, 1, parts[0].palette);
    for (const polygon of backToFront(polygons(parts, this.grid), boxFromClip, AXES.indexOf(axis)))
      this.#drawPolygon(axis, polygon);
    gl.disable(gl.BLEND);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** Shows the picture, encoded as sRGB. @param {{background: number[]}} look */
  present({ background }) {
    const gl = this.#gl;
    const { handle, locations } = this.#shown;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.#size[0], this.#size[1]);
    gl.useProgram(handle);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#corners);
    gl.enableVertexAttribArray(0);
    gl.disableVertexAttribArray(1);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    bind(gl, 0, this.#target.texture);
    gl.uniform1i(locations.picture, 0);
    gl.uniform2f(locations.size, this.#size[0], this.#size[1]);
    gl.uniform3fv(locations.background, new Float32Array(background));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** The picture as the package's picture would be: premultiplied linear light, row 0 on top. */
  readPixels() {
    const gl = this.#gl;
    const [width, height] = this.#size;
    const pixels = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#target.frame);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const upright = new Float32Array(pixels.length);
    for (let y = 0; y < height; y++) {
      for (let at = 0; at < 4 * width; at++)
        upright[4 * width * (height - 1 - y) + at] = pixels[4 * width * y + at] / 255;
    }
    return { width, height, pixels: upright };
  }

  /** Frees everything on the GPU. */
  dispose() {
    const gl = this.#gl;
    this.#free();
    for (const buffer of [this.#corners, this.#square]) gl.deleteBuffer(buffer);
    gl.deleteFramebuffer(this.#target.frame);
    gl.deleteTexture(this.#target.texture);
    for (const each of [this.#slices, this.#shown]) gl.deleteProgram(each.handle);
  }

  #free() {
    for (const { indices, palette } of this.#parts) {
      this.#gl.deleteTexture(indices);
      this.#gl.deleteTexture(palette);
    }
    this.#parts = [];
  }

  /** @param {any} record @param {Uint8Array} bytes @returns {Part} */
  #part(record, bytes) {
    const gl = this.#gl;
    const [, height, width] = record.shape_zyx;
    const layout = record.slices;
    return {
      layout,
      size: [width, height],
      distance: record.reference_mm,
      indices: texture(gl, gl.LUMINANCE, width, height, bytes.subarray(PALETTE_BYTES)),
      palette: texture(gl, gl.RGBA, PALETTE_BYTES / 4, 1, bytes.subarray(0, PALETTE_BYTES)),
      largest: layout.largest_opacity ?? 1,
    };
  }

  /** Uploads the palettes of an edited function, or of the package's own. */
  #recolour() {
    const gl = this.#gl;
    const name = this.program;
    const edit = this.#edits.get(name);
    const channel = this.#pack.manifest.channels[0];
    const own = channel.transfer_functions.find((each) => each.name === name);
    this.edited = 0;
    if (!this.#pack.manifest.editing || !own) return;
    for (const part of this.#parts) {
      const colours = paletteOf(edit ?? own, channel.quantization.window, part.distance);
      bind(gl, 1, part.palette);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 1, gl.RGBA, gl.UNSIGNED_BYTE, colours);
      part.largest = colours.reduce((most, each, at) => (at % 4 === 3 ? Math.max(most, each) : most), 0) / 255 || 1;
      this.edited += colours.length;
    }
    this.onchange();
  }

  #begin() {
    const gl = this.#gl;
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#target.frame);
    if (this.#size[0] !== width || this.#size[1] !== height) {
      gl.deleteTexture(this.#target.texture);
      this.#target.texture = texture(gl, gl.RGBA, width, height, null);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.#target.texture, 0);
      this.#size = [width, height];
    }
    gl.viewport(0, 0, width, height);
    for (const test of [gl.DEPTH_TEST, gl.CULL_FACE, gl.DITHER, gl.SCISSOR_TEST]) gl.disable(test);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  /** The stack that faces the viewer most. @param {number[]} boxFromClip @returns {{axis: Axis, cosine: number}} */
  #facing(boxFromClip) {
    const [near, far] = [-1, 1].map((depth) => moved(boxFromClip, [0, 0, depth]));
    const length = Math.hypot(...far.map((each, at) => each - near[at]));
    const along = AXES.map((axis, at) => ({ axis, cosine: Math.abs(far[at] - near[at]) / length }));
    const held = along.filter(({ axis }) => this.#parts.some((part) => part.layout.axis === axis));
    const most = Math.max(...held.map(({ cosine }) => cosine));
    return held.filter(({ cosine }) => cosine >= most - TIE)[0];
  }

  /** @param {Axis} axis @param {Polygon} polygon */
  #drawPolygon(axis, { place, slice, next, share }) {
    const gl = this.#gl;
    const { locations } = this.#slices;
    bind(gl, 0, slice.part.indices);
    bind(gl, 2, next.part.indices);
    gl.uniform4fv(locations.tile, [...slice.tile, ...slice.part.size]);
    gl.uniform4fv(locations.next_tile, [...next.tile, ...next.part.size]);
    gl.uniform1f(locations.next_share, share);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#square);
    gl.bufferData(gl.ARRAY_BUFFER, square(axis, this.grid, place), gl.STREAM_DRAW);
    gl.enableVertexAttribArray(0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 20, 0);
    gl.vertexAttribPointer(1, 2, gl.FLOAT, false, 20, 12);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
}

/**
 * Bytes of a palette: premultiplied colours with the opacity of a path.
 * @param {{points: any[]}} edit @param {readonly number[]} window @param {number} distance
 */
export function paletteOf(edit, window, distance) {
  const table = sampled(edit, window, 256);
  const opacity = (/** @type {number} */ entry) => -Math.expm1(-table[4 * entry + 3] * distance);
  return Uint8Array.from(table, (each, at) => round(255 * (opacity(at >> 2) * (at % 4 === 3 ? 1 : each))));
}

/** Corners of a slice at a place along its axis: box millimetres, and texels of the slice. @param {Axis} axis @param {any} grid @param {number} place */
function square(axis, grid, place) {
  const spacing = [...grid.spacing_mm_zyx].reverse();
  const extent = [...grid.extent_mm_zyx].reverse();
  const [column, row] = ACROSS[axis];
  return new Float32Array(
    [0, 1, 2, 3].flatMap((corner) => {
      const at = [place, place, place];
      at[column] = corner & 1 ? extent[column] : 0;
      at[row] = corner & 2 ? extent[row] : 0;
      return [...at, at[column] / spacing[column], at[row] / spacing[row]];
    }),
  );
}

/** Polygons of a stack, in the order of its slices. @param {Part[]} parts @param {any} grid @returns {Polygon[]} */
function polygons(parts, grid) {
  const { axis, layers = 1 } = parts[0].layout;
  const along = 2 - AXES.indexOf(axis);
  const slices = parts.flatMap((part) => {
    const {
      slices: count,
      tiles_x: wide,
      slice_shape_yx: [rows, columns],
    } = part.layout;
    return Array.from({ length: count }, (_, at) => ({
      part,
      tile: [(at % wide) * columns, Math.floor(at / wide) * rows],
    }));
  });
  return Array.from({ length: slices.length * layers }, (_, number) => {
    const middle = (number + 0.5) / layers;
    const between = Math.min(Math.max(middle - 0.5, 0), slices.length - 1);
    const lower = Math.floor(between);
    const place = Math.min(middle * grid.spacing_mm_zyx[along], grid.extent_mm_zyx[along]);
    return {
      place,
      slice: slices[lower],
      next: slices[Math.min(lower + 1, slices.length - 1)],
      share: between - lower,
    };
  });
}

/** Polygons, the farthest first. @param {Polygon[]} all @param {number[]} boxFromClip @param {number} axis */
function backToFront(all, boxFromClip, axis) {
  // Where the matrix of a perspective has its eye; with parallel rays a direction, w = 0.
  const [eye, w] = [-boxFromClip[8 + axis], -boxFromClip[11]];
  const far = Math.abs(w) * 1e9 < Math.abs(eye);
  const key = (/** @type {Polygon} */ { place }) => (far ? eye * place : -Math.abs(place - eye / w));
  return all.sort((a, b) => key(a) - key(b));
}

/** @param {WebGLRenderingContext} gl @param {number} target @param {BufferSource} data */
function buffer(gl, target, data) {
  const made = /** @type {WebGLBuffer} */ (gl.createBuffer());
  gl.bindBuffer(target, made);
  gl.bufferData(target, data, gl.STATIC_DRAW);
  return made;
}

/** @param {WebGLRenderingContext} gl @param {number} unit @param {WebGLTexture} made */
function bind(gl, unit, made) {
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, made);
}

/** A texture without a filter: only colours are filtered. @param {WebGLRenderingContext} gl @param {number} format @param {number} width @param {number} height @param {Uint8Array | null} texels */
function texture(gl, format, width, height, texels) {
  const made = /** @type {WebGLTexture} */ (gl.createTexture());
  bind(gl, 0, made);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, format, gl.UNSIGNED_BYTE, texels);
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, gl.NEAREST],
    [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ])
    gl.texParameteri(gl.TEXTURE_2D, name, value);
  return made;
}
