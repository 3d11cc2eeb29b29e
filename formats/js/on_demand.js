/**
 * Draws a picture from bricks that are fetched as its view needs them, for volumes of any size. spec/on_demand.md.
 *
 * Bricks are chosen when the camera rests: those first that take most of the error away for each byte. While they come,
 * each place is drawn from the finest brick that is there. While it moves, some are fetched for where it goes.
 */
import { BrickIndex } from "./bricks/brick_index.js";
import { fetchBricks } from "./bricks/brick_fetch.js";
import { BrickPool } from "./bricks/brick_pool.js";
import { ViewLoss, inOrder } from "./bricks/view_loss.js";
import { VolpkgError } from "./core/messages.js";
import { createRenderer } from "./core/renderer.js";

/** @typedef {import("./core/renderer.js").Renderer} Renderer */
/** @typedef {import("./core/drawing.js").Choice} Choice */
/**
 * @typedef {object} OnDemandOptions
 * @property {number} [memoryBytes] of bricks; all of the pool if absent
 * @property {number} [target] root mean square error that suffices; half of the package's tolerance if absent
 * @property {(error: unknown) => void} [onError] told of bricks that are damaged or missing
 * @property {(state: BrickState) => void} [onState] told whenever `state` is another one
 */
/**
 * The picture on the screen. `bound` is the largest root mean square error, over seen pixels, that the missing bricks make.
 * @typedef {{bound: number, missing: number, missingBytes: number, bricks: number, fetchedBytes: number, damaged: number}} BrickState
 */

/** @typedef {{places: readonly (readonly number[])[], mm?: number}} Places x, y, z in box millimetres, and voxels that suffice there */

/** Milliseconds between two looks at the camera; it rests if both see the same. */
const REST = 80;
/** Bricks that are asked for before the bound is looked at again. */
const BATCH = 16;
/** How far bricks are fetched ahead of a moving camera, in looks. */
const AHEAD = 3;
/** Rays along each axis of the picture while the camera moves, so that no frame waits. */
const MOVING_RAYS = 16;
/** Milliseconds until a brick whose request failed is asked for again. */
const RETRY = 10_000;
const ROUNDS = 4;

/** The bricks that a renderer holds. Get one from `drawOnDemand`. */
export class Bricks {
  #renderer;
  #index;
  #options;
  #pool;
  /** Bricks that are damaged or missing, and when they are asked for again. @type {Map<number, number>} */
  #broken = new Map();
  #fetched = 0;
  /** @type {ViewLoss | null} */
  #view = null;
  /** The camera of the last look, and the one for which bricks were chosen. */
  #last = { key: "", matrix: /** @type {number[]} */ ([]) };
  #chosen = "";
  #wanted = /** @type {number[]} */ ([]);
  /** Bricks under slices and picked points: they stay until bricks are chosen for another view. */
  #pinned = /** @type {number[]} */ ([]);
  /** Bricks that may go, the one that the view misses least at the end. @type {number[]} */
  #spare = [];
  #fetching = false;
  #ended = false;
  #abort = new AbortController();
  /** @type {ReturnType<typeof setInterval> | undefined} */
  #timer;
  /** The picture on the screen. @type {BrickState} */
  state = { bound: 1, missing: 0, missingBytes: 0, bricks: 0, fetchedBytes: 0, damaged: 0 };

  /** @param {Renderer} renderer @param {BrickIndex} index @param {OnDemandOptions} options */
  constructor(renderer, index, options) {
    this.#renderer = renderer;
    this.#index = index;
    this.#options = options;
    this.#pool = new BrickPool(renderer, index, options.memoryBytes);
    this.#timer = setInterval(() => this.#look(), REST);
    renderer.package.signal.addEventListener("abort", () => this.dispose());
  }

  /** Ends fetching. */
  dispose() {
    this.#ended = true;
    clearInterval(this.#timer);
    this.#abort.abort();
  }

  /**
   * The textures and the program of the renderer. Called when it loads, also after a lost context: all bricks are then lost.
   * @param {import("./core/package.js").Package} pack @param {string} picture
   * @param {typeof import("./core/drawing.js").namedBy} namedBy
   * @returns {Choice}
   */
  choose(pack, picture, namedBy) {
    const from = pack.manifest.pictures.find(({ name }) => name === picture)?.on_demand;
    if (!from) {
      const known = "its levels: it has no bricks on demand";
      throw new VolpkgError("VP5018", { package: pack.name, level: "bricks on demand", transfer: picture, known });
    }
    this.#chosen = "";
    const { own, texels } = this.#pool.textures(this);
    const { program, textures } = namedBy(pack, from, (name) => own.find((texture) => texture.name === name));
    return {
      picture,
      program,
      level: { index: 0, factors_zyx: [1, 1, 1], grid: pack.manifest.grid, filter: "none" },
      stepMm: from.step_mm,
      textures,
      values: {},
      bricks: this,
      texels,
    };
  }

  /**
   * Reads a picked point or a slice, and again from the finest bricks under it once these are there.
   * @template Found @param {() => Found} read
   * @param {(found: Found) => Places} under the places that it was read from
   * @returns {Promise<Found>}
   */
  async sharpened(read, under) {
    let found = read();
    for (let round = 0; round < ROUNDS && (await this.#under(under(found))); round++) found = read();
    return found;
  }

  /** Fetches bricks at places, in a small memory coarser ones. @param {Places} places @returns whether any came */
  async #under({ places, mm = 0 }) {
    if (this.#ended || !this.#pool.ready) return false;
    const room = this.#pool.places - this.#index.floor.length;
    let found = this.#index.at(places, mm);
    for (let size = Math.max(mm, this.#index.voxelOf(0)); found.length > room && room > 0; size *= 2)
      found = this.#index.at(places, size);
    this.#pinned = found.slice(0, Math.max(room, 0));
    this.#choose();
    const next = this.#pinned.filter((brick) => this.#isMissing(brick));
    const before = this.#fetched;
    if (next.length) await this.#get(next, this.#renderer.package.signal);
    return this.#fetched > before;
  }

  /** @param {number} brick */
  #isMissing(brick) {
    return !this.#pool.has(brick) && !this.#broken.has(brick);
  }

  /** Looks at the camera: chooses bricks if it has come to rest somewhere else, or for where it goes. */
  #look() {
    if (/** @type {any} */ (this.#renderer)._levels.closed) return this.dispose();
    const { inside } = this.#renderer;
    if (!inside?.last || !this.#pool.ready) return;
    const { boxFromClip, width, height } = inside.last;
    const planes = inside.drawn.clip?.planes ?? [];
    const key = [...boxFromClip, width, height, ...planes].join();
    const before = this.#last;
    this.#last = { key, matrix: boxFromClip };
    const due = [...this.#broken].filter(([, until]) => until <= performance.now());
    if (key === this.#chosen && (this.#fetching || !due.length)) return;
    for (const [brick] of due) this.#broken.delete(brick);
    if (key === before.key && !this.#renderer.moving) {
      this.#chosen = key;
      this.#view = new ViewLoss(this.#index, boxFromClip, width, { planes });
      this.#pinned = [];
      this.#follow(Infinity);
    } else if (!this.#fetching && before.key) {
      const ahead = boxFromClip.map((each, i) => each + AHEAD * (each - before.matrix[i]));
      this.#chosen = "";
      this.#view = new ViewLoss(this.#index, ahead, width, { planes, rays: MOVING_RAYS });
      this.#follow(1);
    }
  }

  /** Chooses bricks and fetches them. @param {number} batches at most */
  #follow(batches) {
    this.#abort.abort();
    this.#choose();
    this.#show();
    this.#fetch(batches);
  }

  #choose() {
    const gains = this.#view?.gains() ?? new Float64Array(this.#index.count);
    const order = [...this.#index.floor, ...this.#pinned, ...inOrder(this.#index, gains)];
    this.#wanted = [...new Set(order)].filter((brick) => !this.#broken.has(brick)).slice(0, this.#pool.places);
    const wanted = new Set(this.#wanted);
    this.#spare = this.#pool.bricks.filter((brick) => !wanted.has(brick)).sort((a, b) => gains[b] - gains[a]);
  }

  /** @param {number} batches */
  async #fetch(batches) {
    this.#abort = new AbortController();
    const { signal } = this.#abort;
    const { tolerance } = /** @type {any} */ (this.#index.pack.manifest.render);
    const { target = tolerance.rmse / 2 } = this.#options;
    this.#fetching = true;
    // The first ones take the most error away, so that less is asked for where little is missing.
    while (!signal.aborted && this.state.bound > target && batches-- > 0) {
      const next = this.#wanted.filter((brick) => this.#isMissing(brick)).slice(0, BATCH);
      if (!next.length) break;
      await this.#get(next, signal);
    }
    if (!signal.aborted) this.#fetching = false;
  }

  /** @param {number[]} bricks @param {AbortSignal} signal */
  async #get(bricks, signal) {
    const end = () => !signal.aborted && this.#show();
    await fetchBricks(
      this.#index,
      bricks,
      signal,
      (brick, texels) => !signal.aborted && this.#hold(brick, texels),
      (brick, error, lasts) => {
        this.#broken.set(brick, lasts ? Infinity : performance.now() + RETRY);
        this.#options.onError?.(error);
      },
      end,
    );
    end();
  }

  /** Holds a brick, in the place of the one that the view misses least. @param {number} brick @param {Uint8Array} texels */
  #hold(brick, texels) {
    if (this.#pool.has(brick)) return;
    if (this.#pool.isFull) {
      const other = this.#spare.pop();
      if (other === undefined) {
        this.#wanted = this.#wanted.filter((wanted) => wanted !== brick);
        return;
      }
      this.#pool.release(other);
    }
    this.#pool.hold(brick, texels);
    this.#fetched += this.#index.size[brick];
  }

  /** Sends the pages, and draws again. */
  #show() {
    this.#pool.send();
    const missing = this.#wanted.filter((brick) => this.#isMissing(brick));
    this.state = {
      bound: this.#view?.bound(this.#pool.drawn) ?? 1,
      missing: missing.length,
      missingBytes: missing.reduce((sum, brick) => sum + this.#index.size[brick], 0),
      bricks: this.#pool.bricks.length,
      fetchedBytes: this.#fetched,
      damaged: this.#broken.size,
    };
    this.#options.onState?.(this.state);
    /** @type {any} */ (this.#renderer)._changed();
  }
}

/**
 * A renderer that begins with the coarsest level and draws from bricks as soon as their index is there; of a package
 * without bricks on demand, a renderer as `createRenderer` makes it.
 * @param {import("./gl/formats.js").Gl | null} gl @param {import("./core/package.js").Package} pack
 * @param {import("./core/options.js").RendererOptions & OnDemandOptions} [options]
 */
export async function createOnDemand(gl, pack, options = {}) {
  if (!pack.manifest.on_demand) return createRenderer(gl, pack, options);
  const level = Math.max(...pack.programs[0].levels);
  const renderer = await createRenderer(gl, pack, { level, ...options });
  drawOnDemand(renderer, options).catch((error) => options.onError?.(error));
  return renderer;
}

/**
 * Draws the picture of a renderer from bricks, from now on.
 * @param {Renderer} renderer @param {OnDemandOptions} [options]
 * @returns {Promise<Bricks | null>} null for a package without bricks on demand
 */
export async function drawOnDemand(renderer, options = {}) {
  const { package: pack } = renderer;
  const layout = pack.manifest.on_demand;
  if (!layout) return null;
  const bricks = new Bricks(renderer, new BrickIndex(pack, layout, await pack.read(layout.index)), options);
  await renderer.setPoint(/** @type {any} */ (bricks));
  return bricks;
}
