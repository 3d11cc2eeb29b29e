/**
 * The first point of a ray that is seen. The package's own program draws the ray to many ends at once, each a pixel:
 * the point lies where the opacity passes the one that is asked for. Techniques, transfer functions and cuts are
 * therefore respected.
 */
import { cross, dot, moved, unit, worldFromBox } from "../camera.js";
import { VolpkgError } from "../core/messages.js";
import {
  drawValues,
  labelLine,
  labelOf,
  mediaOnGrids,
  mediumLines,
  segmentsOf,
  valueOf,
  valueProgram,
  windowOf,
} from "./values.js";

/** @typedef {import("../core/renderer.js").Renderer} Renderer */
/** @typedef {readonly number[]} Point x, y, z */
/** @typedef {{opacity?: number}} PickOptions accumulated opacity at the point, 0.5 if absent */
/**
 * The point that a ray hits.
 * @typedef {object} Hit
 * @property {number[]} position_mm x, y, z in the patient's space (LPS)
 * @property {number[]} voxel x, y, z in voxels of level 0; the first has its centre at 0
 * @property {number[]} box_mm x, y, z in box millimetres
 * @property {number | null} value in the scan's unit; null where the program reads classified voxels or several
 *   channels
 * @property {Record<string, number | null> | null} values where channels lie on several grids: the value of each, by the
 *   name of the channel, null outside of its grid
 * @property {string[] | null} segments names of the segments that its voxel belongs to; null where the program draws
 *   no segments
 * @property {number[] | null} normal x, y, z in the patient's space, 1 long, towards the viewer; null where the value
 *   does not change
 * @property {number} depth_mm from the beginning of the ray
 * @property {number} uncertainty_mm of the depth: half a step
 */

const PICTURE = {};
const ENDS = 32;
const ROUNDS = 3;
const OPACITY = 0.5;
/** Places on the way to a point where bricks are wanted. */
const WAY = 512;
/** Rays in a step. */
const WIDTHS = 8;
const MAIN = `uniform vec3 u_pick;
void main() {
  float inside = 1.0;
  float value = stored_value(position(u_pick));
`;
/** The label of the voxel at a place, or the value of a medium: `labelLine` or `mediumLines` follow. */
const BEGIN = `uniform vec3 u_pick;
void main() {
  float inside = 1.0;
`;

/**
 * Reads out a pixel of the renderer's last picture.
 * @param {Renderer} renderer @param {number} x from the left edge @param {number} y from the upper edge
 * @param {PickOptions} [options]
 * @returns {Promise<Hit | null>}
 */
export async function pickPixel(renderer, x, y, options) {
  const { last } = renderer.inside ?? {};
  if (!last || !Number.isFinite(x) || !Number.isFinite(y)) {
    throw new VolpkgError("VP7080", {
      what: `the pixel ${x}, ${y}`,
      reason: "no picture was drawn, or it is not a number",
    });
  }
  const at = [(2 * x) / last.width - 1, 1 - (2 * y) / last.height];
  const [from, to] = [-1, 1].map((depth) => moved(last.boxFromClip, [at[0], at[1], depth]));
  const picker = new Picker(renderer);
  await picker.prepare();
  const read = () => picker.pick(from, to, options);
  const { bricks } = renderer.inside?.drawn.choice ?? {};
  return bricks ? bricks.sharpened(read, (hit) => ({ places: along(from, hit?.box_mm ?? to) })) : read();
}

/** Places on the way to a point. @param {Point} from @param {Point} to */
function along(from, to) {
  return Array.from({ length: WAY }, (_, i) => from.map((each, axis) => each + ((to[axis] - each) * i) / (WAY - 1)));
}

/** Picks with a renderer. */
export class Picker {
  #renderer;
  /**
   * Programs that give values, by the name of the one that draws.
   * @type {Map<string, Record<string, import("../gl/program.js").Linked | null>>}
   */
  #programs = new Map();
  /** The context that they belong to; it changes after a lost context. @type {unknown} */
  #device = null;

  /** @param {Renderer} renderer */
  constructor(renderer) {
    this.#renderer = renderer;
  }

  /** Prepares reading of values, so that `pick` can return them at once. */
  async prepare() {
    const inside = this.#renderer.inside;
    if (!inside) return;
    const { device, drawn } = inside;
    const { name } = drawn.choice.program;
    if (this.#device !== device) this.#programs.clear();
    this.#device = device;
    if (this.#programs.has(name)) return;
    const label = `${BEGIN}${labelLine(this.#renderer, "u_pick")}`;
    const media = mediaOnGrids(this.#renderer).map(async ({ channel }, i) => {
      const main = `${BEGIN}${mediumLines(i, "u_pick")}`;
      return [channel, await valueProgram(this.#renderer, `values ${i}`, main, `stored_value_${i}`)];
    });
    this.#programs.set(name, {
      ...Object.fromEntries(await Promise.all(media)),
      value: await valueProgram(this.#renderer, "values", MAIN),
      label: segmentsOf(this.#renderer) && (await valueProgram(this.#renderer, "labels", label)),
    });
  }

  /**
   * The first point between two positions where the opacity is reached, or null.
   * @param {Point} from @param {Point} to box millimetres @param {PickOptions} [options]
   * @returns {Hit | null}
   */
  pick(from, to, { opacity = OPACITY } = {}) {
    if (!(opacity > 0 && opacity < 1)) {
      throw new VolpkgError("VP7080", { what: `an opacity of ${opacity}`, reason: "it must lie between 0 and 1" });
    }
    const renderer = this.#renderer;
    const inside = renderer.inside;
    const part = inside && within(from, to, renderer.grid.extent_mm_zyx);
    if (!inside || !part) return null;
    const at = (/** @type {number} */ t) => from.map((each, i) => each + t * (to[i] - each));
    let [low, high] = part;
    for (let round = 0; round < ROUNDS; round++) {
      const size = (high - low) / ENDS;
      const reached = this.#opacities(at(part[0]), at, low, size).findIndex((x) => x >= opacity);
      if (reached < 0 && !round) return null;
      // Shorter rays have other samples: at the end of a round the last of it may lack what the round before had.
      const n = reached < 0 ? ENDS - 1 : reached;
      [low, high] = [low + n * size, low + (n + 1) * size];
    }
    return this.#hit(from, at((low + high) / 2));
  }

  /**
   * Opacities of rays from one beginning to equally distant ends.
   * @param {Point} from @param {(t: number) => Point} at @param {number} low @param {number} size
   */
  #opacities(from, at, low, size) {
    const renderer = this.#renderer;
    const { gl, device, drawn } = /** @type {NonNullable<Renderer["inside"]>} */ (renderer.inside);
    const picture = device.pictures.of(PICTURE);
    // GPUs round corners of triangles to parts of a pixel: a wide pixel moves the faces where rays begin.
    const width = renderer.step / WIDTHS;
    // Passes are read at the pixel of the picture: each then is a picture of its own.
    const wide = drawn.technique ? 1 : ENDS;
    /** @type {number[]} */
    const found = [];
    renderer.use(() => picture.bind(wide, 1));
    for (let i = 0; i < ENDS; i++) {
      const matrix = rayMatrix(from, at(low + (i + 1) * size), width);
      renderer.draw({ boxFromClip: matrix, viewport: [i % wide, 0, 1, 1], target: picture.frame, moving: false });
      if ((i + 1) % wide) continue;
      renderer.use(() => {
        const pixels = picture.read();
        for (let n = 0; n < wide; n++) found.push(pixels[4 * n + 3]);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      });
    }
    return found;
  }

  /** @param {Point} from @param {Point} box @returns {Hit} */
  #hit(from, box) {
    const { grid, step } = this.#renderer;
    const { drawn } = /** @type {NonNullable<Renderer["inside"]>} */ (this.#renderer.inside);
    const [hz, hy, hx] = drawn.choice.level.grid.spacing_mm_zyx;
    const steps = [hx, hy, hz];
    const beside = steps.flatMap((size, axis) =>
      [-1, 1].map((side) => box.map((each, i) => each + (i === axis ? side * size : 0))),
    );
    const places = [box, ...beside];
    const pixels = this.#pixels("value", places);
    const values = pixels && places.map((_, i) => valueOf(pixels, i));
    const segments = segmentsOf(this.#renderer);
    const label = segments && this.#pixels("label", [box]);
    const [lowest, highest] = windowOf(this.#renderer);
    const slope = steps.map((size, axis) => (values ? (values[2 + 2 * axis] - values[1 + 2 * axis]) / (2 * size) : 0));
    const ray = box.map((each, i) => each - from[i]);
    const sign = dot(slope, ray) > 0 ? -1 : 1;
    const inWorld = grid.direction.map((row) => sign * dot(row, slope));
    return {
      position_mm: moved(worldFromBox(grid), box),
      voxel: box.map((each, i) => each / grid.spacing_mm_zyx[2 - i] - 0.5),
      box_mm: [...box],
      value: values && lowest + values[0] * (highest - lowest),
      values: this.#media(box),
      segments: segments && label ? (segments.labels[labelOf(label, 0)]?.segments ?? []) : null,
      normal: Math.hypot(...slope) > 0 ? unit(inWorld) : null,
      depth_mm: Math.hypot(...ray),
      uncertainty_mm: step / 2,
    };
  }

  /** Values of media on grids of their own; null without any. @param {Point} box */
  #media(box) {
    const media = mediaOnGrids(this.#renderer).map(({ channel, transfer }) => {
      const [lowest, highest] = windowOf(this.#renderer, transfer);
      const pixels = this.#pixels(channel, [box]);
      return [channel, pixels?.[3] ? lowest + valueOf(pixels, 0) * (highest - lowest) : null];
    });
    return media.length ? Object.fromEntries(media) : null;
  }

  /** Pixels of places; null if the program has no such numbers. @param {string} kind @param {Point[]} places */
  #pixels(kind, places) {
    const { device, drawn } = /** @type {NonNullable<Renderer["inside"]>} */ (this.#renderer.inside);
    const linked = this.#programs.get(drawn.choice.program.name)?.[kind];
    if (!linked || device !== this.#device) return null;
    return drawValues(this.#renderer, linked, [places.length, 1], (gl, { locations }) => {
      places.forEach((place, i) => {
        gl.viewport(i, 0, 1, 1);
        gl.uniform3fv(locations.u_pick, new Float32Array(place));
        gl.drawArrays(gl.TRIANGLES, 0, 3);
      });
    });
  }
}

/** A camera that sees one ray. @param {Point} from @param {Point} to @param {number} width of the ray, millimetres */
function rayMatrix(from, to, width) {
  const half = from.map((each, i) => (to[i] - each) / 2);
  const away = unit(half);
  const side = unit(cross(away, Math.abs(away[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0])).map((value) => (value * width) / 2);
  const above = cross(side, away);
  const middle = from.map((each, i) => each + half[i]);
  return [...side, 0, ...above, 0, ...half, 0, ...middle, 1];
}

/**
 * The part of a ray that lies in the box; null if it misses.
 * @param {Point} from @param {Point} to @param {readonly number[]} extent z, y, x
 */
function within(from, to, extent) {
  let [enter, leave] = [0, 1];
  for (let axis = 0; axis < 3; axis++) {
    const slope = to[axis] - from[axis];
    const faces = [0, extent[2 - axis]];
    if (!slope && (from[axis] < 0 || from[axis] > faces[1])) return null;
    const ends = slope ? faces.map((face) => (face - from[axis]) / slope) : [0, 1];
    enter = Math.max(enter, Math.min(...ends));
    leave = Math.min(leave, Math.max(...ends));
  }
  return leave > enter ? /** @type {const} */ ([enter, leave]) : null;
}
