/** Skip tables from occupied blocks, and their texels. spec/skipping.md. */
import { FORMATS, fromHalf } from "../gl/formats.js";

/** @typedef {import("../core/types.js").Texture} Texture */
/** @typedef {readonly [z: number, y: number, x: number]} Shape */

const LARGEST = 255;

/** Texel of a voxel in a texture that is 3D, or a mosaic of one slice a texel. @param {Texture} texture @param {Shape} shape @returns {(z: number, y: number, x: number) => number} */
export function placeIn({ mosaic }, [, height, width]) {
  if (!mosaic) return (z, y, x) => (z * height + y) * width + x;
  const {
    gutter = 0,
    padding_yx: [below, right] = [0, 0],
    tiles_x: columns,
    texture_shape_yx: [, row],
  } = mosaic;
  const [tall, wide] = [height + 2 * gutter + below, width + 2 * gutter + right];
  return (z, y, x) => (Math.floor(z / columns) * tall + gutter + y) * row + (z % columns) * wide + gutter + x;
}

/**
 * Values of a texture of one component, normalised, in the order of voxels.
 * @param {Texture} texture @param {Uint8Array} texels @param {Shape} shape
 */
export function entriesOf(texture, texels, shape) {
  const { type } = FORMATS[texture.gl.internal_format];
  const list = type === "UNSIGNED_BYTE" ? texels : new Uint16Array(texels.buffer, texels.byteOffset, texels.length / 2);
  const value =
    type === "HALF_FLOAT" ? fromHalf : (/** @type {number} */ each) => each / (type === "UNSIGNED_BYTE" ? 255 : 65535);
  const at = placeIn(texture, shape);
  const found = new Float64Array(shape[0] * shape[1] * shape[2]);
  each(shape, (i, z, y, x) => {
    found[i] = value(list[at(z, y, x)]);
  });
  return found;
}

/**
 * Texels of the table of a kind.
 * @param {Uint8Array} occupied 1 for each block that is not empty @param {Shape} shape of the blocks @param {string} kind @param {Texture} texture
 */
export function skipEntries(occupied, shape, kind, texture) {
  const entries = table(occupied, shape, kind);
  if (!texture.mosaic) return entries;
  const [, height, width] = texture.shape_zyx;
  const texels = new Uint8Array(height * width);
  const whole = /** @type {const} */ ([entries.length / shape[1] / shape[2], shape[1], shape[2]]);
  const at = placeIn(texture, whole);
  each(whole, (i, z, y, x) => {
    texels[at(z, y, x)] = entries[i];
  });
  return texels;
}

/** @param {Uint8Array} occupied @param {Shape} shape @param {string} kind */
export function table(occupied, shape, kind) {
  if (kind === "blocks") return occupied.map((value) => 1 - value);
  if (kind === "pyramid") return pyramid(occupied, shape);
  if (kind === "euclidean") return spheres(occupied, shape);
  if (kind === "octants") {
    const all = new Uint8Array(8 * occupied.length);
    for (let octant = 0; octant < 8; octant++) all.set(cubes(occupied, shape, octant), octant * occupied.length);
    return all;
  }
  const distance = chebyshev(occupied, shape);
  return kind === "table16" ? distance.map((value) => Number(value > 1)) : distance;
}

/** @param {Shape} shape @param {(i: number, z: number, y: number, x: number) => void} visit */
function each([depth, height, width], visit) {
  let i = 0;
  for (let z = 0; z < depth; z++) for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) visit(i++, z, y, x);
}

/** Chessboard distance to the nearest occupied block; empty outside. @param {Uint8Array} occupied @param {Shape} shape */
function chebyshev(occupied, shape) {
  const found = occupied.map((value) => (value ? 0 : LARGEST));
  for (const octant of [0, 7]) sweep(found, shape, octant, 13, (i, least) => Math.min(found[i], least + 1));
  return found;
}

/** The edge of the largest empty cube with each block as its hindmost corner. @param {Uint8Array} occupied @param {Shape} shape @param {number} octant */
function cubes(occupied, shape, octant) {
  const found = new Uint8Array(occupied.length);
  sweep(found, shape, octant, 7, (i, least) => (occupied[i] ? 0 : Math.min(least + 1, LARGEST)));
  return found;
}

/** Neighbours that a sweep towards smaller x, y and z has passed: the seven of a cube, or all thirteen. */
const PASSED = [
  [0, 0, 1],
  [0, 1, 0],
  [0, 1, 1],
  [1, 0, 0],
  [1, 0, 1],
  [1, 1, 0],
  [1, 1, 1],
  [0, 1, -1],
  [1, 0, -1],
  [1, -1, 0],
  [1, -1, -1],
  [1, -1, 1],
  [1, 1, -1],
];

/**
 * Visits all blocks against the direction of an octant (towards smaller x if 1, y if 2, z if 4), with the least value of
 * the first `count` neighbours that were passed.
 * @param {Uint8Array} values @param {Shape} shape @param {number} octant @param {number} count
 * @param {(i: number, least: number) => number} value
 */
function sweep(values, shape, octant, count, value) {
  const [depth, height, width] = shape;
  const signs = [4, 2, 1].map((bit) => (octant & bit ? -1 : 1));
  // With a margin of empty blocks no neighbour is missing.
  const strides = [(height + 2) * (width + 2), width + 2, 1];
  const passed = new Uint8Array(strides[0] * (depth + 2)).fill(LARGEST);
  const steps = PASSED.slice(0, count).map((step) =>
    step.reduce((sum, n, axis) => sum + n * signs[axis] * strides[axis], 0),
  );
  const place = (/** @type {number} */ k, /** @type {number} */ axis) => (signs[axis] > 0 ? shape[axis] - 1 - k : k);
  for (let a = 0; a < depth; a++)
    for (let b = 0; b < height; b++) {
      const [z, y, x] = [place(a, 0), place(b, 1), place(0, 2)];
      let i = (z * height + y) * width + x;
      let at = (z + 1) * strides[0] + (y + 1) * strides[1] + x + 1;
      for (let c = 0; c < width; c++, i -= signs[2], at -= signs[2]) {
        let least = LARGEST;
        for (let k = 0; k < count; k++) if (passed[at + steps[k]] < least) least = passed[at + steps[k]];
        passed[at] = values[i] = value(i, least);
      }
    }
}

/** 1 + l where the cell of edge 2^l, aligned to multiples of it, is empty. @param {Uint8Array} occupied @param {Shape} shape */
function pyramid(occupied, shape) {
  const entries = occupied.map((one) => 1 - one);
  let [cells, size] = [occupied, shape];
  for (let level = 1; Math.max(...size) > 1; level++) {
    const below = cells;
    const [, height, width] = size;
    const above = /** @type {Shape} */ (/** @type {unknown} */ (size.map((n) => Math.ceil(n / 2))));
    cells = new Uint8Array(above[0] * above[1] * above[2]);
    each(size, (_, z, y, x) => {
      if (below[(z * height + y) * width + x]) cells[((z >> 1) * above[1] + (y >> 1)) * above[2] + (x >> 1)] = 1;
    });
    size = above;
    each(shape, (i, z, y, x) => {
      if (!cells[((z >> level) * above[1] + (y >> level)) * above[2] + (x >> level)]) entries[i] = level + 1;
    });
  }
  return entries;
}

/** 1 + r where all within r blocks of any point of an empty block is empty. @param {Uint8Array} occupied @param {Shape} shape */
function spheres(occupied, shape) {
  const squares = Float64Array.from(occupied, (one) => (one ? 0 : LARGEST ** 2));
  const [, height, width] = shape;
  [height * width, width, 1].forEach((stride, axis) => {
    const before = squares.slice();
    each(shape, (i, z, y, x) => {
      const at = [z, y, x][axis];
      for (let k = 0; k < shape[axis]; k++)
        squares[i] = Math.min(squares[i], before[i + (k - at) * stride] + (k - at) ** 2);
    });
  });
  // The distance of corners: points in two blocks may be a diagonal nearer.
  return Uint8Array.from(squares, (square, i) =>
    occupied[i] ? 0 : Math.min(Math.floor(Math.max(Math.fround(Math.sqrt(square)) - Math.sqrt(3), 0)) + 1, LARGEST),
  );
}
