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
  const at = placeIn(texture, shape);
  each(shape, (i, z, y, x) => {
    texels[at(z, y, x)] = entries[i];
  });
  return texels;
}

/** @param {Uint8Array} occupied @param {Shape} shape @param {string} kind */
export function table(occupied, shape, kind) {
  if (kind === "blocks") return occupied.map((value) => 1 - value);
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
  const [depth, height, width] = shape;
  // With a margin of empty blocks no neighbour is missing.
  const strides = [(height + 2) * (width + 2), width + 2, 1];
  const steps = PASSED.map((step) => step.reduce((sum, n, axis) => sum + n * strides[axis], 0));
  const padded = new Uint8Array(strides[0] * (depth + 2)).fill(LARGEST);
  const at = (/** @type {number} */ z, /** @type {number} */ y, /** @type {number} */ x) =>
    (z + 1) * strides[0] + (y + 1) * strides[1] + x + 1;
  each(shape, (i, z, y, x) => {
    if (occupied[i]) padded[at(z, y, x)] = 0;
  });
  for (const sign of [-1, 1])
    each(shape, (_, z, y, x) => {
      const own = sign < 0 ? at(z, y, x) : at(depth - 1 - z, height - 1 - y, width - 1 - x);
      let least = padded[own];
      for (const step of steps) least = Math.min(least, padded[own + sign * step] + 1);
      padded[own] = least;
    });
  const found = new Uint8Array(occupied.length);
  each(shape, (i, z, y, x) => {
    found[i] = padded[at(z, y, x)];
  });
  return found;
}

/** Neighbours behind a block, along z, y and x: a sweep towards smaller ones has passed them. */
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
