/** Rays of a view through the index of bricks: what each brick would change in the picture. spec/on_demand.md. */
import { WIDTHS } from "./brick_index.js";

/** @typedef {import("./brick_index.js").BrickIndex} BrickIndex */

/** Rays along each axis of the picture. */
const RAYS = 48;
const MOST_OPAQUE = 0.999;

/** The changes that bricks would make in one view. */
export class ViewLoss {
  #index;
  /** Where the segments of each ray begin, and the number of all. @type {number[]} */
  #starts = [];
  /** The cell of each segment. @type {number[]} */
  #cells = [];
  /** The loss of each level in each segment, level by level. @type {number[]} */
  #losses = [];
  /** Rays that see something, at least. */
  #seen = 0;

  /** Planes that cut the volume. @type {readonly (readonly number[])[]} */
  #planes;

  /**
   * @param {BrickIndex} index @param {ArrayLike<number>} boxFromClip column by column @param {number} width in pixels
   * @param {{planes?: readonly (readonly number[])[], rays?: number}} [how] rays along each axis of the picture
   */
  constructor(index, boxFromClip, width, { planes = [], rays = RAYS } = {}) {
    this.#index = index;
    this.#planes = planes;
    for (let i = 0; i < rays * rays; i++) {
      const x = (((i % rays) + 0.5) / rays) * 2 - 1;
      const y = 1 - ((Math.floor(i / rays) + 0.5) / rays) * 2;
      this.#starts.push(this.#cells.length);
      this.#follow(boxFromClip, x, y, 2 / width);
    }
    this.#starts.push(this.#cells.length);
  }

  /** @param {ArrayLike<number>} matrix @param {number} x @param {number} y @param {number} pixel in clip coordinates */
  #follow(matrix, x, y, pixel) {
    const { layout, levels, spacing, extent, loss, size, opacity, cover } = this.#index;
    const near = place(matrix, x, y, -1);
    const far = place(matrix, x, y, 1);
    const beside = [place(matrix, x + pixel, y, -1), place(matrix, x + pixel, y, 1)];
    const ray = near.map((at, axis) => far[axis] - at);
    const length = Math.hypot(...ray);
    const share = ray.map((value) => (value / length) ** 2);
    const slope = ray.map((value) => (Math.abs(value) < 1e-12 ? 1e-12 : value));
    let enter = 0;
    let leave = 1;
    for (let axis = 0; axis < 3; axis++) {
      const [one, other] = [-near[axis] / slope[axis], (extent[axis] - near[axis]) / slope[axis]];
      enter = Math.max(enter, Math.min(one, other));
      leave = Math.min(leave, Math.max(one, other));
    }
    for (const [x, y, z, off] of this.#planes) {
      const [from, to] = [near, far].map(([pz, py, px]) => x * px + y * py + z * pz + off);
      if (from < 0 && to < 0) return;
      if (from < 0) enter = Math.max(enter, from / (from - to));
      if (to < 0) leave = Math.min(leave, from / (from - to));
    }
    if (!(enter < leave)) return;
    const { counts } = levels[0];
    const edge = spacing.map((h) => h * layout.size);
    const coarsest = levels.length - 1;
    /** Brick of each level that the ray is in, and the light that reached it. */
    const inside = new Int32Array(coarsest).fill(-1);
    const reaching = new Float64Array(coarsest);
    let [at, through, covered] = [enter, 1, 0];
    const cell = near.map((from, axis) =>
      clamp(Math.floor((from + slope[axis] * (enter + 1e-9)) / edge[axis]), counts[axis] - 1),
    );
    for (let turns = counts[0] + counts[1] + counts[2] + 3; at < leave && turns; turns--) {
      const next = cell.map((k, axis) => ((k + (slope[axis] > 0 ? 1 : 0)) * edge[axis] - near[axis]) / slope[axis]);
      let axis = 0;
      for (let each = 1; each < 3; each++) if (next[each] < next[axis]) axis = each;
      const end = Math.min(Math.max(next[axis], at), leave);
      const chord = (end - at) * length;
      const number = (cell[0] * counts[1] + cell[1]) * counts[2] + cell[2];
      if (chord > 0) {
        const wide = Math.hypot(
          ...near.map((from, i) => (beside[0][i] - from) * (1 - at) + (beside[1][i] - far[i]) * at),
        );
        this.#cells.push(number);
        for (let k = 0; k < coarsest; k++) {
          const level = levels[k];
          const own = level.cells[number];
          const brick = level.first + own;
          if (inside[k] !== own) [inside[k], reaching[k]] = [own, through];
          const [z, y, x] = this.#index.placeOf(brick, k);
          const perEdge = share[0] / level.edges[0][z] + share[1] / level.edges[1][y] + share[2] / level.edges[2][x];
          const width = clamp(Math.floor(Math.log2(Math.max(wide / this.#index.voxelOf(k), 1))), WIDTHS - 1);
          this.#losses.push(size[brick] ? loss[brick * WIDTHS + width] * reaching[k] * chord * perEdge : 0);
        }
        const finest = levels[0].first + number;
        covered = Math.max(covered, cover[finest]);
        let depth = 0;
        for (let i = 0; i < 3; i++) {
          // Opacities are in the order x, y, z.
          const opaque = Math.min(opacity[3 * finest + 2 - i], MOST_OPAQUE);
          depth -= (share[i] * Math.log1p(-opaque)) / levels[0].edges[i][cell[i]];
        }
        through *= Math.exp(-depth * chord);
      }
      at = end;
      cell[axis] += slope[axis] > 0 ? 1 : -1;
      if (cell[axis] < 0 || cell[axis] >= counts[axis]) break;
    }
    this.#seen += covered;
  }

  /** The loss that each brick takes away from all rays, by its number. */
  gains() {
    const { count, levels } = this.#index;
    const found = new Float64Array(count);
    const kinds = levels.length - 1;
    this.#cells.forEach((cell, i) => {
      for (let k = 0; k < kinds; k++) found[levels[k].first + levels[k].cells[cell]] += this.#losses[i * kinds + k];
    });
    return found;
  }

  /**
   * The largest root mean square error of the picture from the levels that are drawn at each cell, against that of all bricks.
   * @param {Uint8Array} drawn level at each brick of level 0
   */
  bound(drawn) {
    if (!this.#seen) return 0;
    const kinds = this.#index.levels.length - 1;
    let sum = 0;
    for (let ray = 0; ray + 1 < this.#starts.length; ray++) {
      const missing = new Float64Array(kinds);
      for (let i = this.#starts[ray]; i < this.#starts[ray + 1]; i++) {
        const level = drawn[this.#cells[i]];
        for (let k = 0; k < level; k++) missing[k] += this.#losses[i * kinds + k];
      }
      sum += Math.min(
        missing.reduce((squares, loss) => squares + loss ** 2, 0),
        1,
      );
    }
    return Math.sqrt(sum / this.#seen);
  }
}

/** @param {number} value @param {number} most */
const clamp = (value, most) => Math.min(Math.max(value, 0), most);

/** A place in box millimetres, z, y, x. @param {ArrayLike<number>} m @param {number} x @param {number} y @param {number} z */
function place(m, x, y, z) {
  const [px, py, pz, w] = [0, 1, 2, 3].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
  return [pz / w, py / w, px / w];
}

/**
 * Stored bricks that change the picture but are not of the coarsest level: the greatest loss per byte first, none before
 * the one that covers it.
 * @param {BrickIndex} index @param {Float64Array} gains
 * @returns {number[]}
 */
export function inOrder(index, gains) {
  const { levels, size } = index;
  /** Gains of a brick and of all that it covers. */
  const below = gains.slice();
  for (let k = 1; k < levels.length; k++) {
    const { first, counts } = levels[k];
    for (let brick = first; brick < first + all(counts); brick++)
      for (const child of index.children(brick, k)) below[brick] += below[child];
  }
  /** Of equals the one of the finer level, then in the order of the index. @type {number[]} */
  const heap = [];
  const level = new Uint8Array(index.count);
  levels.forEach(({ first, counts }, k) => level.fill(k, first, first + all(counts)));
  const before = (/** @type {number} */ one, /** @type {number} */ other) =>
    gains[one] / size[one] - gains[other] / size[other] || level[other] - level[one] || other - one;
  const push = (/** @type {number} */ brick) => {
    let at = heap.push(brick) - 1;
    while (at && before(heap[at], heap[(at - 1) >> 1]) > 0) {
      const up = (at - 1) >> 1;
      [heap[at], heap[up]] = [heap[up], heap[at]];
      at = up;
    }
  };
  const pop = () => {
    const top = heap[0];
    const last = /** @type {number} */ (heap.pop());
    if (heap.length) {
      heap[0] = last;
      for (let at = 0; ; ) {
        let best = at;
        for (const child of [2 * at + 1, 2 * at + 2])
          if (child < heap.length && before(heap[child], heap[best]) > 0) best = child;
        if (best === at) break;
        [heap[at], heap[best]] = [heap[best], heap[at]];
        at = best;
      }
    }
    return top;
  };
  const open = (/** @type {number} */ brick) => {
    for (const child of index.children(brick, level[brick])) {
      if (!size[child]) open(child);
      else if (below[child] > 0) push(child);
    }
  };
  const { first } = levels[levels.length - 1];
  for (let brick = first; brick < first + all(levels[levels.length - 1].counts); brick++) open(brick);
  const found = [];
  while (heap.length) {
    const brick = pop();
    found.push(brick);
    open(brick);
  }
  return found;
}

/** Number of bricks of a level. @param {number[]} counts */
const all = ([z, y, x]) => z * y * x;
