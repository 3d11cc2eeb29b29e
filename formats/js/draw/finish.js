/**
 * Pictures that are finished part by part, within the time of a frame (Díaz-García et al. 2018, section 4): a coarse
 * picture, enlarged, whose tiles are replaced by full ones from the middle outwards. Each pixel is either enlarged or
 * final, so that no frame is worse than the one before it. It serves every technique.
 */
import { WHOLE, linkNow } from "../gl/program.js";

/** @typedef {import("../core/renderer.js").Renderer} Renderer */
/** @typedef {readonly [x: number, y: number, width: number, height: number]} Tile */

/** Tiles along an axis of the picture, and the least pixels of their edge. */
const TILES = 8;
const LEAST = 32;
const COPY = `precision highp float;
uniform sampler2D u_picture;
uniform vec3 u_size;
void main() {
  gl_FragColor = texture2D(u_picture, gl_FragCoord.xy / u_size.xy);
}
`;

/** Finishes one picture of a renderer. `step` draws as much as a frame has time for; `present` shows it. */
export class Finishing {
  #renderer;
  #boxFromClip;
  #size;
  #budget;
  /** @type {Tile[]} */
  #tiles;
  #done = 0;
  /** Milliseconds of a tile, as measured. */
  #each = Infinity;
  #started = false;

  /**
   * @param {Renderer} renderer
   * @param {{boxFromClip: ArrayLike<number>, width: number, height: number, budgetMs: number, over?: boolean}} how
   *   over: the renderer already has a coarser picture of the same view, which replaces the coarse one
   */
  constructor(renderer, { boxFromClip, width, height, budgetMs, over = false }) {
    this.#renderer = renderer;
    this.#boxFromClip = Array.from(boxFromClip);
    this.#size = [width, height];
    this.#budget = budgetMs;
    this.#started = over;
    const { program } = renderer.inside?.drawn.choice ?? {};
    // Layers from the light and opacities that are cut have targets of their own, which hold whole pictures.
    const whole = program?.light_pass || program?.technique === "view-slices-as-published";
    this.#tiles = whole ? [[0, 0, width, height]] : tilesOf(width, height);
  }

  /** Draws the coarse picture first, then tiles. @returns {number} share of the picture that is final */
  step() {
    const { inside } = this.#renderer;
    if (!inside) return 1;
    const start = performance.now();
    if (!this.#started) this.#begin();
    else {
      const fits = Math.floor(this.#budget / this.#each);
      // Later tiles may cost more: at most twice as many as before.
      const count = Math.max(1, Math.min(fits, 2 * this.#done));
      const next = this.#tiles.slice(this.#done, this.#done + count);
      for (const tile of next) this.#draw(tile, ++this.#done === this.#tiles.length);
      this.#wait();
      this.#each = (performance.now() - start) / next.length;
    }
    return this.#done / this.#tiles.length;
  }

  /** The coarse picture, in all pixels. */
  #begin() {
    const renderer = this.#renderer;
    const [width, height] = this.#size;
    const key = {};
    this.#started = true;
    renderer.draw({ boxFromClip: this.#boxFromClip, viewport: [0, 0, width, height], keep: key, moving: true });
    const { gl, device } = /** @type {NonNullable<Renderer["inside"]>} */ (renderer.inside);
    renderer.use(() => {
      const picture = device.pictures.of();
      const copy = linkNow(gl, "copy", WHOLE, COPY);
      picture.bind(width, height);
      device.state(false);
      gl.viewport(0, 0, width, height);
      gl.useProgram(copy.handle);
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, device.pictures.of(key).texture);
      gl.uniform1i(copy.locations.u_picture, 0);
      gl.uniform3f(copy.locations.u_size, width, height, 1);
      device.triangle();
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      device.unbind();
      gl.deleteProgram(copy.handle);
      device.pictures.forget(key);
    });
    this.#wait();
  }

  /** With the last tile the picture is the renderer's own in full quality. @param {Tile} tile @param {boolean} last */
  #draw(tile, last) {
    const [width, height] = this.#size;
    const { device } = /** @type {NonNullable<Renderer["inside"]>} */ (this.#renderer.inside);
    const target = last ? undefined : device.pictures.of().frame;
    const viewport = /** @type {const} */ ([0, 0, width, height]);
    this.#renderer.draw({ boxFromClip: this.#boxFromClip, viewport, target, part: tile, moving: false });
  }

  /** Waits for the GPU, which reading a pixel does. */
  #wait() {
    const { gl, device } = /** @type {NonNullable<Renderer["inside"]>} */ (this.#renderer.inside);
    this.#renderer.use(() => {
      gl.bindFramebuffer(gl.FRAMEBUFFER, device.pictures.of().frame);
      device.pictures.of().readOne();
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    });
  }
}

/** Tiles of a picture, those in the middle first. @param {number} width @param {number} height @returns {Tile[]} */
export function tilesOf(width, height) {
  const edges = [width, height].map((size) => Math.max(LEAST, Math.ceil(size / TILES)));
  /** @type {Tile[]} */
  const tiles = [];
  for (let y = 0; y < height; y += edges[1]) {
    for (let x = 0; x < width; x += edges[0]) {
      tiles.push([x, y, Math.min(edges[0], width - x), Math.min(edges[1], height - y)]);
    }
  }
  const away = (/** @type {Tile} */ [x, y, wide, high]) =>
    Math.hypot(x + wide / 2 - width / 2, y + high / 2 - height / 2);
  return tiles.sort((a, b) => away(a) - away(b));
}
