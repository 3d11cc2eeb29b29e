/**
 * Draws a picture from bricks that are fetched as its view needs them, for volumes of any size. spec/on_demand.md.
 *
 * Bricks are chosen when the camera rests: those first that take most of the error away for each byte. While they come,
 * each place is drawn from the finest brick that is there.
 */
import { BrickIndex } from "./bricks/brick_index.js";
import { fetchBricks } from "./bricks/brick_fetch.js";
import { ViewLoss, inOrder } from "./bricks/view_loss.js";
import { VolpkgError } from "./core/messages.js";
import { createRenderer } from "./core/renderer.js";
import { FORMATS, uploadOf } from "./gl/formats.js";

/** @typedef {import("./core/renderer.js").Renderer} Renderer */
/** @typedef {import("./core/drawing.js").Choice} Choice */
/** @typedef {import("./core/types.js").Texture} Texture */
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

/** Milliseconds that a camera rests before bricks are chosen for it. */
const REST = 80;
/** Bricks that are asked for before the bound is looked at again. */
const BATCH = 16;
const POOL = "brick-pool";
const PAGES = "brick-pages";

/** The bricks that a renderer holds. Get one from `drawOnDemand`. */
class Bricks {
  #renderer;
  #index;
  #options;
  #places;
  /** Bricks in the pool, by their place. @type {Int32Array} */
  #held;
  /** Place of each brick that is held. @type {Map<number, number>} */
  #at = new Map();
  /** Bricks that are missing or damaged. @type {Set<number>} */
  #broken = new Set();
  /** Level at each brick of level 0. */
  #drawn;
  #pages;
  #fetched = 0;
  /** @type {ViewLoss | null} */
  #view = null;
  #seen = "";
  #wanted = /** @type {number[]} */ ([]);
  #abort = new AbortController();
  /** @type {ReturnType<typeof setInterval> | undefined} */
  #timer;
  /** The picture on the screen. @type {BrickState} */
  state = { bound: 1, missing: 0, missingBytes: 0, bricks: 0, fetchedBytes: 0, damaged: 0 };

  /** @param {Renderer} renderer @param {BrickIndex} index @param {OnDemandOptions} options */
  constructor(renderer, index, options) {
    const { layout, pitch, levels } = index;
    const [z, y, x] = layout.places_zyx;
    const bytes = pitch ** 3 * (layout.format === "r8unorm" ? 1 : 2);
    const allowed = Math.floor((options.memoryBytes ?? Infinity) / bytes);
    this.#renderer = renderer;
    this.#index = index;
    this.#options = options;
    this.#places = Math.min(z * y * x, Math.max(allowed, index.floor.length, 1));
    this.#held = new Int32Array(z * y * x).fill(-1);
    const cells = levels[0].cells.length;
    this.#drawn = new Uint8Array(cells);
    this.#pages = new Uint8Array(4 * cells);
    this.#timer = setInterval(() => this.#look(), REST);
    renderer.package.signal.addEventListener("abort", () => this.dispose());
  }

  /** Ends fetching. */
  dispose() {
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
    this.#held.fill(-1);
    this.#at.clear();
    this.#seen = "";
    const { layout, pitch, levels } = this.#index;
    const [z, y, x] = layout.places_zyx.map((n) => n * pitch);
    const { api } = pack.manifest.profile;
    const made = (/** @type {string} */ name, /** @type {string} */ format, /** @type {number[]} */ shape) =>
      /** @type {Texture} */ ({
        name,
        role: "volume",
        file: name,
        shape_zyx: shape,
        format,
        dimension: "3d",
        gl: uploadOf(format, "3d", api),
        filter: name === POOL ? "linear" : "nearest",
        level: 0,
        part: 0,
      });
    const own = [made(POOL, layout.format, [z, y, x]), made(PAGES, "rgba8unorm", levels[0].counts)];
    const { program, textures } = namedBy(pack, from, (name) => own.find((each) => each.name === name));
    this.#point();
    return {
      picture,
      program,
      level: { index: 0, factors_zyx: [1, 1, 1], grid: pack.manifest.grid, filter: "none" },
      stepMm: from.step_mm,
      textures,
      values: {},
      bricks: this,
      texels: {
        [POOL]: new Uint8Array(z * y * x * (layout.format === "r8unorm" ? 1 : 2)),
        [PAGES]: this.#pages.slice(),
      },
    };
  }

  /** Chooses bricks if the camera has come to rest somewhere else. */
  #look() {
    if (/** @type {any} */ (this.#renderer)._levels.closed) return this.dispose();
    const { inside } = this.#renderer;
    if (!inside?.last || !this.#texture(POOL)) return;
    const { boxFromClip, width, height } = inside.last;
    const seen = [...boxFromClip, width, height].join();
    if (seen === this.#seen || this.#renderer.moving) return;
    this.#seen = seen;
    this.#abort.abort();
    this.#abort = new AbortController();
    this.#view = new ViewLoss(this.#index, boxFromClip, width);
    const order = inOrder(this.#index, this.#view.gains());
    this.#wanted = [...this.#index.floor, ...order].filter((brick) => !this.#broken.has(brick)).slice(0, this.#places);
    this.#show();
    this.#fetch();
  }

  async #fetch() {
    const { signal } = this.#abort;
    const { tolerance } = /** @type {any} */ (this.#index.pack.manifest.render);
    const { target = tolerance.rmse / 2 } = this.#options;
    // The first ones take the most error away, so that less is asked for where little is missing.
    while (!signal.aborted && this.state.bound > target) {
      const next = this.#wanted.filter((brick) => !this.#at.has(brick) && !this.#broken.has(brick)).slice(0, BATCH);
      if (!next.length) return;
      this.#makeRoom(next.length);
      await fetchBricks(
        this.#index,
        next,
        signal,
        (brick, texels) => !signal.aborted && this.#hold(brick, texels),
        (brick, error) => {
          this.#broken.add(brick);
          this.#options.onError?.(error);
        },
        () => !signal.aborted && this.#show(),
      );
      this.#show();
    }
  }

  /** Puts a brick into a free place. @param {number} brick @param {Uint8Array} texels */
  #hold(brick, texels) {
    const place = this.#held.indexOf(-1);
    if (place < 0 || place >= this.#places) return;
    this.#held[place] = brick;
    this.#at.set(brick, place);
    this.#fetched += this.#index.size[brick];
    const { layout, pitch } = this.#index;
    const [, ny, nx] = layout.places_zyx;
    const corner = [place % nx, Math.floor(place / nx) % ny, Math.floor(place / (nx * ny))].map((at) => at * pitch);
    this.#upload(POOL, corner, [pitch, pitch, pitch], texels);
  }

  /** Lets bricks go that the view does not want, until so many places are free. @param {number} count */
  #makeRoom(count) {
    const wanted = new Set(this.#wanted);
    let free = this.#places - this.#at.size;
    for (let place = 0; place < this.#places && free < count; place++) {
      const brick = this.#held[place];
      if (brick < 0 || wanted.has(brick)) continue;
      this.#held[place] = -1;
      this.#at.delete(brick);
      free++;
    }
    // Nothing may be seen in the place of what replaces it.
    this.#send();
  }

  /** Sends the pages, and draws again. */
  #show() {
    this.#send();
    const missing = this.#wanted.filter((brick) => !this.#at.has(brick) && !this.#broken.has(brick));
    this.state = {
      bound: this.#view?.bound(this.#drawn) ?? 1,
      missing: missing.length,
      missingBytes: missing.reduce((sum, brick) => sum + this.#index.size[brick], 0),
      bricks: this.#at.size,
      fetchedBytes: this.#fetched,
      damaged: this.#broken.size,
    };
    this.#options.onState?.(this.state);
    /** @type {any} */ (this.#renderer)._changed();
  }

  #send() {
    this.#point();
    const [z, y, x] = this.#index.levels[0].counts;
    this.#upload(PAGES, [0, 0, 0], [x, y, z], this.#pages);
  }

  /** Lets each brick of level 0 name the finest one that is held there, or its one value. */
  #point() {
    const { layout, levels, size, low } = this.#index;
    const [, ny, nx] = layout.places_zyx;
    const to16 = layout.format === "r8unorm" ? 257 : 1;
    for (let cell = 0; cell < this.#drawn.length; cell++) {
      for (let k = 0; k < levels.length; k++) {
        const brick = levels[k].first + levels[k].cells[cell];
        const place = this.#at.get(brick);
        if (place === undefined && size[brick] && k < levels.length - 1) continue;
        const value = low[brick] * to16;
        this.#pages.set(
          place === undefined
            ? [value >> 8, value & 255, 0, 0]
            : [place % nx, Math.floor(place / nx) % ny, Math.floor(place / (nx * ny)), 1 + k],
          4 * cell,
        );
        this.#drawn[cell] = k;
        break;
      }
    }
  }

  /** @param {string} name */
  #texture(name) {
    const { drawn } = this.#renderer.inside ?? {};
    const unit = drawn?.choice.textures.findIndex((each) => each.name === name) ?? -1;
    return unit < 0 ? null : drawn?.textures[unit];
  }

  /** @param {string} name @param {number[]} at x, y, z @param {number[]} shape x, y, z @param {Uint8Array} bytes */
  #upload(name, [x, y, z], [width, height, depth], bytes) {
    const { gl: context } = this.#renderer.inside ?? {};
    const texture = this.#texture(name);
    if (!context || !texture) return;
    const gl = /** @type {WebGL2RenderingContext} */ (context);
    const { format, type } = /** @type {any} */ (
      name === PAGES ? FORMATS.RGBA8 : uploadOf(this.#index.layout.format, "3d", "es3.0")
    );
    const data = type === "UNSIGNED_BYTE" ? bytes : new Uint16Array(bytes.buffer, bytes.byteOffset, bytes.length / 2);
    this.#renderer.use(() => {
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(texture.target, texture.handle);
      gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
      const names = /** @type {any} */ (gl);
      gl.texSubImage3D(texture.target, 0, x, y, z, width, height, depth, names[format], names[type], data);
    });
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
