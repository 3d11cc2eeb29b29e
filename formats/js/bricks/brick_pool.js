/** The pool of bricks on a GPU, and the pages that say where each place is drawn from. spec/on_demand.md. */
import { FORMATS, uploadOf } from "../gl/formats.js";

/** @typedef {import("../core/renderer.js").Renderer} Renderer */
/** @typedef {import("../core/types.js").Texture} Texture */
/** @typedef {import("./brick_index.js").BrickIndex} BrickIndex */

const POOL = "brick-pool";
const PAGES = "brick-pages";

/** The bricks on the GPU of one renderer. */
export class BrickPool {
  #renderer;
  #index;
  /** Place of each brick that is held. @type {Map<number, number>} */
  #at = new Map();
  /** Places without a brick. @type {number[]} */
  #free = [];
  #pages;
  /** Objects of the context that have the bricks, and the texels that their textures began with. @type {unknown} */
  #device = null;
  /** @type {Record<string, Uint8Array>} */
  #begun = {};
  /** Level at each brick of level 0. */
  drawn;
  /** Bricks that fit. */
  places;

  /** @param {Renderer} renderer @param {BrickIndex} index @param {number} [memoryBytes] all of the pool if absent */
  constructor(renderer, index, memoryBytes = Infinity) {
    const [z, y, x] = index.layout.places_zyx;
    const allowed = Math.floor(memoryBytes / (index.pitch ** 3 * this.#bytes(index)));
    this.#renderer = renderer;
    this.#index = index;
    this.places = Math.min(z * y * x, Math.max(allowed, index.floor.length, 1));
    const cells = index.levels[0].cells.length;
    this.drawn = new Uint8Array(cells);
    this.#pages = new Uint8Array(4 * cells);
  }

  /** Bytes of a texel. @param {BrickIndex} index */
  #bytes({ layout }) {
    return layout.format === "r8unorm" ? 1 : 2;
  }

  /** Bricks that are held, the oldest first. */
  get bricks() {
    return [...this.#at.keys()];
  }

  /** @param {number} brick */
  has(brick) {
    return this.#at.has(brick);
  }

  /** Whether each place has a brick. */
  get isFull() {
    return !this.#free.length;
  }

  /** Whether the renderer draws from it. */
  get ready() {
    return this.#texture(POOL) !== null;
  }

  /**
   * The two textures, and the texels that they begin with. A renderer that draws from them keeps its bricks when it
   * loads again, for a cut or another picture. @param {unknown} owner as the choice of the renderer names it
   */
  textures(owner) {
    const { layout, pitch, levels, pack } = this.#index;
    const shape = layout.places_zyx.map((n) => n * pitch);
    const { device, drawn } = /** @type {any} */ (this.#renderer)._levels;
    if (device !== this.#device || drawn?.choice.bricks !== owner) {
      this.#device = device;
      this.#at.clear();
      this.#free = Array.from({ length: this.places }, (_, place) => this.places - 1 - place);
      this.#point();
      const [z, y, x] = shape;
      this.#begun = { [POOL]: new Uint8Array(z * y * x * this.#bytes(this.#index)), [PAGES]: this.#pages.slice() };
    }
    const made = (/** @type {string} */ name, /** @type {string} */ format, /** @type {number[]} */ shape_zyx) => {
      const gl = uploadOf(format, "3d", pack.manifest.profile.api);
      const filter = name === POOL ? "linear" : "nearest";
      const texture = { name, role: "volume", file: name, shape_zyx, format, dimension: "3d", gl, filter };
      return /** @type {Texture} */ ({ ...texture, level: 0, part: 0 });
    };
    return {
      own: [made(POOL, layout.format, shape), made(PAGES, "rgba8unorm", levels[0].counts)],
      texels: this.#begun,
    };
  }

  /** Puts a brick into a free place. @param {number} brick @param {Uint8Array} texels */
  hold(brick, texels) {
    const place = this.#free.pop();
    if (place === undefined) return;
    this.#at.set(brick, place);
    const { pitch } = this.#index;
    // The GPU has these texels; the array stays the key of its texture.
    const { buffer } = this.#begun[POOL];
    if (buffer.byteLength) globalThis.structuredClone?.(buffer, { transfer: [/** @type {ArrayBuffer} */ (buffer)] });
    this.#upload(
      POOL,
      this.#corner(place).map((at) => at * pitch),
      [pitch, pitch, pitch],
      texels,
    );
  }

  /** Lets a brick go. Its place is drawn from coarser ones as soon as pages are sent. @param {number} brick */
  release(brick) {
    const place = this.#at.get(brick);
    if (place !== undefined) this.#free.push(place);
    this.#at.delete(brick);
  }

  /** Sends the pages. */
  send() {
    this.#point();
    const [z, y, x] = this.#index.levels[0].counts;
    this.#upload(PAGES, [0, 0, 0], [x, y, z], this.#pages);
  }

  /** x, y, z of a place. @param {number} place */
  #corner(place) {
    const [, ny, nx] = this.#index.layout.places_zyx;
    return [place % nx, Math.floor(place / nx) % ny, Math.floor(place / (nx * ny))];
  }

  /** Lets each brick of level 0 name the finest one that is held there, or its one value. */
  #point() {
    const { layout, levels, size, low } = this.#index;
    const to16 = layout.format === "r8unorm" ? 257 : 1;
    for (let cell = 0; cell < this.drawn.length; cell++) {
      for (let k = 0; k < levels.length; k++) {
        const brick = levels[k].first + levels[k].cells[cell];
        const place = this.#at.get(brick);
        if (place === undefined && size[brick] && k < levels.length - 1) continue;
        const value = low[brick] * to16;
        this.#pages.set(
          place === undefined ? [value >> 8, value & 255, 0, 0] : [...this.#corner(place), 1 + k],
          4 * cell,
        );
        this.drawn[cell] = k;
        break;
      }
    }
  }

  /** @param {string} name */
  #texture(name) {
    const { drawn } = this.#renderer.inside ?? {};
    const unit = drawn?.choice.textures.findIndex((texture) => texture.name === name) ?? -1;
    return (unit >= 0 && drawn?.textures[unit]) || null;
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
