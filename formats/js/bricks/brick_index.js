/** The index of bricks on demand: the record of each brick, by level. spec/on_demand.md. */
import { fromHalf } from "../gl/formats.js";

/** @typedef {import("../core/package.js").Package} Package */
/** @typedef {import("../core/types.js").OnDemand} OnDemand */
/** @typedef {import("../core/types.js").Three} Three */

const RECORD_BYTES = 24;
/** Widths of a pixel, in voxels of the brick, for which a record has the loss: 1, 2, 4 and 8. */
export const WIDTHS = 4;

/**
 * A level. `cells` is its brick at each brick of level 0; `edges` the lengths of bricks along z, y and x, without the part that lies
 * beyond the level.
 * @typedef {{first: number, counts: number[], factors: number[], cells: Int32Array, edges: Float64Array[]}} BrickLevel
 */

/** Bricks are numbered as their records, the coarsest level first. */
export class BrickIndex {
  /** @param {Package} pack @param {OnDemand} layout @param {Uint8Array} data */
  constructor(pack, layout, data) {
    const { shape_zyx: shape, spacing_mm_zyx: spacing, extent_mm_zyx: extent } = pack.manifest.grid;
    this.pack = pack;
    this.layout = layout;
    this.pitch = layout.size + 2 * layout.ghost;
    this.spacing = spacing;
    this.extent = extent;
    const count = data.length / RECORD_BYTES;
    const view = new DataView(data.buffer, data.byteOffset, data.length);
    this.count = count;
    this.size = new Uint32Array(count);
    this.begin = new Float64Array(count);
    this.crc = new Uint32Array(count);
    this.low = new Uint16Array(count);
    this.loss = new Float32Array(count * WIDTHS);
    this.opacity = new Float32Array(count * 3);
    this.cover = new Float32Array(count);
    for (let i = 0, at = 0; i < count; i++) {
      const from = i * RECORD_BYTES;
      this.size[i] = view.getUint32(from, true);
      this.begin[i] = at;
      at += this.size[i];
      this.crc[i] = view.getUint32(from + 4, true);
      this.low[i] = view.getUint16(from + 8, true);
      for (let k = 0; k < WIDTHS; k++) this.loss[i * WIDTHS + k] = fromHalf(view.getUint16(from + 12 + 2 * k, true));
      for (let k = 0; k < 3; k++) this.opacity[3 * i + k] = view.getUint8(from + 20 + k) / 255;
      this.cover[i] = view.getUint8(from + 23) / 255;
    }
    /** The finest first. @type {BrickLevel[]} */
    this.levels = [];
    const all = layout.levels.map(({ factors_zyx: factors }) => {
      const voxels = shape.map((n, axis) => Math.ceil(n / factors[axis]));
      return { factors, voxels, counts: voxels.map((n) => Math.ceil(n / layout.size)) };
    });
    const cells = all[0].counts;
    let first = count;
    for (const { factors, voxels, counts } of all) {
      first -= counts[0] * counts[1] * counts[2];
      const edges = counts.map((n, axis) =>
        Float64Array.from({ length: n }, (_, i) => {
          return Math.min(layout.size, voxels[axis] - i * layout.size) * factors[axis] * spacing[axis];
        }),
      );
      this.levels.push({ first, counts, factors, cells: covering(cells, counts, factors), edges });
    }
  }

  /** Bricks of the coarsest level that are stored. */
  get floor() {
    const [z, y, x] = this.levels[this.levels.length - 1].counts;
    return Array.from({ length: z * y * x }, (_, brick) => brick).filter((brick) => this.size[brick]);
  }

  /** Length of the shortest edge of a voxel of a level. @param {number} level */
  voxelOf(level) {
    return Math.min(...this.levels[level].factors.map((f, axis) => f * this.spacing[axis]));
  }

  /**
   * Stored bricks at places, of the coarsest level whose voxels are at most so large.
   * @param {readonly (readonly number[])[]} places x, y, z in box millimetres; others are left out @param {number} mm
   */
  at(places, mm) {
    const { counts } = this.levels[0];
    let level = this.levels.length - 1;
    while (level && this.voxelOf(level) > mm) level--;
    /** @type {Set<number>} */
    const found = new Set();
    for (const place of places) {
      const cell = counts.map((_, axis) => Math.floor(place[2 - axis] / (this.spacing[axis] * this.layout.size)));
      if (cell.some((at, axis) => !(at >= 0 && at < counts[axis]))) continue;
      const { first, cells } = this.levels[level];
      const brick = first + cells[(cell[0] * counts[1] + cell[1]) * counts[2] + cell[2]];
      if (this.size[brick]) found.add(brick);
    }
    return [...found];
  }

  /** The level of a brick. @param {number} brick */
  levelOf(brick) {
    return this.levels.findIndex(({ first }) => brick >= first);
  }

  /** Place of a brick in its level: z, y, x. @param {number} brick @param {number} level */
  placeOf(brick, level) {
    const { first, counts } = this.levels[level];
    const at = brick - first;
    const [, ny, nx] = counts;
    return [Math.floor(at / (nx * ny)), Math.floor(at / nx) % ny, at % nx];
  }

  /** The bricks of the next finer level that a brick covers. @param {number} brick @param {number} level */
  children(brick, level) {
    if (!level) return [];
    const { first, counts, factors } = this.levels[level - 1];
    const place = this.placeOf(brick, level);
    const spans = place.map((at, axis) => {
      const step = this.levels[level].factors[axis] / factors[axis];
      return [at * step, Math.min((at + 1) * step, counts[axis])];
    });
    const found = [];
    for (let z = spans[0][0]; z < spans[0][1]; z++)
      for (let y = spans[1][0]; y < spans[1][1]; y++)
        for (let x = spans[2][0]; x < spans[2][1]; x++) found.push(first + (z * counts[1] + y) * counts[2] + x);
    return found;
  }
}

/** The brick of a level, from 0 on, at each brick of level 0. @param {number[]} cells @param {number[]} counts @param {number[]} factors */
function covering([nz, ny, nx], counts, factors) {
  const found = new Int32Array(nz * ny * nx);
  let at = 0;
  for (let z = 0; z < nz; z++)
    for (let y = 0; y < ny; y++) {
      const row = (Math.floor(z / factors[0]) * counts[1] + Math.floor(y / factors[1])) * counts[2];
      for (let x = 0; x < nx; x++) found[at++] = row + Math.floor(x / factors[2]);
    }
  return found;
}
