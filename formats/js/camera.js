/** Cameras around a volume, and the matrices between spaces. Matrices are lists of 16 numbers, column by column. */

/** @typedef {import("./core/types.js").Grid} Grid */
/** @typedef {import("./core/types.js").Three} Three */
/**
 * Where the viewer is, in millimetres of the patient's space (LPS).
 * @typedef {object} Camera
 * @property {readonly number[]} eye with an orthographic projection a point of the plane where rays begin
 * @property {readonly number[]} forward direction of view, of any length
 * @property {readonly number[]} up not parallel to forward
 * @property {number} height of the field at the distance `focus`; the width follows from the picture
 * @property {number} focus distance from the eye to the middle of the volume; rays end at twice this
 * @property {"orthographic" | "perspective"} projection
 */

const HEAD = /** @type {const} */ ([0, 0, 1]);
const FRONT = /** @type {const} */ ([0, -1, 0]);
/** @type {Record<string, [forward: readonly number[], up: readonly number[]]>} */
const VIEWS = {
  anterior: [[0, 1, 0], HEAD],
  posterior: [[0, -1, 0], HEAD],
  left: [[-1, 0, 0], HEAD],
  right: [[1, 0, 0], HEAD],
  superior: [[0, 0, -1], FRONT],
  inferior: [[0, 0, 1], FRONT],
  "anterior-left": [[-1, 1, -0.5], HEAD],
  "anterior-right": [[1, 1.3, -0.7], HEAD],
  "posterior-left": [[-0.8, -1, 0.6], HEAD],
};

/** @param {readonly number[]} a @param {readonly number[]} b */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {readonly number[]} a @param {readonly number[]} b */
export const dot = (a, b) => a.reduce((sum, each, i) => sum + each * b[i], 0);
/** @param {readonly number[]} a */
export const unit = (a) => a.map((x) => x / Math.hypot(...a));
/** @param {readonly number[]} a @param {readonly number[]} b @param {number} [by] */
const plus = (a, b, by = 1) => a.map((each, i) => each + by * b[i]);

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b @returns {number[]} a · b */
export function multiply(a, b) {
  return Array.from({ length: 16 }, (_, i) =>
    [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[4 * (i >> 2) + k], 0),
  );
}

/** The inverse, by Gauss and Jordan. @param {ArrayLike<number>} matrix @returns {number[]} */
export function invert(matrix) {
  const rows = [0, 1, 2, 3].map((r) =>
    [0, 1, 2, 3, 4, 5, 6, 7].map((c) => (c < 4 ? matrix[4 * c + r] : Number(c - 4 === r))),
  );
  for (let c = 0; c < 4; c++) {
    const pivot = [0, 1, 2, 3]
      .slice(c)
      .reduce((best, r) => (Math.abs(rows[r][c]) > Math.abs(rows[best][c]) ? r : best), c);
    [rows[c], rows[pivot]] = [rows[pivot], rows[c]];
    rows[c] = rows[c].map((x) => x / rows[c][c]);
    for (let r = 0; r < 4; r++) if (r !== c) rows[r] = plus(rows[r], rows[c], -rows[r][c]);
  }
  return Array.from({ length: 16 }, (_, i) => rows[i % 4][4 + (i >> 2)]);
}

/**
 * A point, or a point on a plane of depth in clip coordinates, moved by a matrix.
 * @param {ArrayLike<number>} m
 * @param {readonly number[]} at x, y, z
 */
export function moved(m, [x, y, z]) {
  const [px, py, pz, w] = [0, 1, 2, 3].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
  return [px / w, py / w, pz / w];
}

/** @param {Grid} grid @returns {number[]} from box millimetres to the patient's space */
export function worldFromBox({ direction: d, origin_mm_xyz: origin, spacing_mm_zyx: [hz, hy, hx] }) {
  const corner = origin.map((at, row) => at - (d[row][0] * hx + d[row][1] * hy + d[row][2] * hz) / 2);
  const column = (/** @type {number} */ axis) => [d[0][axis], d[1][axis], d[2][axis], 0];
  return [...column(0), ...column(1), ...column(2), ...corner, 1];
}

/** The middle of a volume in the patient's space, and the length of its diagonal. @param {Grid} grid */
export function middle(grid) {
  const [ez, ey, ex] = grid.extent_mm_zyx;
  return { centre: moved(worldFromBox(grid), [ex / 2, ey / 2, ez / 2]), diagonal: Math.hypot(ex, ey, ez) };
}

/** @param {Camera} camera @param {number} aspect width / height of the picture @returns {number[]} */
export function worldFromClip({ eye, forward, up, height, focus, projection }, aspect) {
  const ahead = unit(forward);
  const right = unit(cross(ahead, up));
  const above = cross(right, ahead);
  const [x, y] = [(height / 2) * aspect, height / 2];
  const columns = [right, above, ahead.map((x) => -x)];
  const rotation = [...columns.flatMap((column) => [...column, 0]), ...eye, 1];
  if (projection === "orthographic")
    return multiply(rotation, [x, 0, 0, 0, 0, y, 0, 0, 0, 0, -focus, 0, 0, 0, -focus, 1]);
  // A ratio of 200 leaves float32 five digits.
  const [near, far] = [focus / 100, focus * 2];
  const depth = (near - far) / (2 * near * far);
  const eyeFromClip = [
    x / focus,
    0,
    0,
    0,
    0,
    y / focus,
    0,
    0,
    0,
    0,
    0,
    depth,
    0,
    0,
    -1,
    (near + far) / (2 * near * far),
  ];
  return multiply(rotation, eyeFromClip);
}

/** The matrix for `Renderer.draw`. @param {Grid} grid @param {Camera} camera @param {number} aspect */
export function boxFromClip(grid, camera, aspect) {
  return multiply(invert(worldFromBox(grid)), worldFromClip(camera, aspect));
}

/**
 * @param {Grid} grid
 * @param {readonly number[]} forward
 * @param {readonly number[]} up
 * @param {Camera["projection"]} projection
 * @returns {Camera}
 */
function cameraFrom(grid, forward, up, projection) {
  const { centre, diagonal } = middle(grid);
  const focus = projection === "orthographic" ? diagonal : 2 * diagonal;
  return {
    eye: plus(centre, unit(forward), -focus),
    forward,
    up,
    height: projection === "orthographic" ? diagonal : 1.2 * diagonal,
    focus,
    projection,
  };
}

/** A camera that turns about the middle of a volume, as a pointer drags it. */
export class Orbit {
  #grid;
  #right = [1, 0, 0];
  #up = [0, 0, 1];
  #forward = [0, 1, 0];
  /** The middle of the picture lies so many millimetres to the right of the volume's and above it. */
  #shift = [0, 0];
  /** How much larger the volume is than in the standard views. */
  zoom = 1;
  /** @type {Camera["projection"]} */
  projection;

  /** @param {Grid} grid @param {Camera["projection"]} [projection] */
  constructor(grid, projection = "perspective") {
    this.#grid = grid;
    this.projection = projection;
  }

  /** Names of the standard views. */
  get views() {
    return Object.keys(VIEWS);
  }

  /** Looks as a standard view does; false if there is no such view. @param {string} name */
  look(name) {
    if (!this.views.includes(name)) return false;
    this.aim(...VIEWS[name]);
    return true;
  }

  /** Looks along `forward`. @param {readonly number[]} forward @param {readonly number[]} up @param {number} zoom */
  aim(forward, up, zoom = 1) {
    this.#forward = unit(forward);
    this.#right = unit(cross(this.#forward, up));
    this.#up = cross(this.#right, this.#forward);
    this.#shift = [0, 0];
    this.zoom = zoom;
  }

  /** Turns the front of the volume, by angles in radians. @param {number} right @param {number} down */
  turn(right, down) {
    const about = (/** @type {number[]} */ v, /** @type {number[]} */ axis, /** @type {number} */ angle) =>
      plus(
        plus(
          v.map((x) => x * Math.cos(angle)),
          cross(axis, v),
          Math.sin(angle),
        ),
        axis,
        dot(axis, v) * (1 - Math.cos(angle)),
      );
    const [up, side] = [this.#up, this.#right];
    const turned = (/** @type {number[]} */ v) => about(about(v, up, -right), side, -down);
    this.#forward = unit(turned(this.#forward));
    this.#right = unit(cross(this.#forward, turned(up)));
    this.#up = cross(this.#right, this.#forward);
  }

  /** Moves the picture, by parts of its height. @param {number} right @param {number} up */
  pan(right, up) {
    const { height } = this.camera;
    this.#shift = plus(this.#shift, [-right * height, -up * height]);
  }

  /** @returns {Camera} */
  get camera() {
    const camera = cameraFrom(this.#grid, this.#forward, this.#up, this.projection);
    const eye = plus(plus(camera.eye, this.#right, this.#shift[0]), this.#up, this.#shift[1]);
    return { ...camera, eye, height: camera.height / this.zoom };
  }

  /**
   * The matrix for `Renderer.draw`.
   * @param {number} aspect width / height of the picture
   * @param {Grid} [grid] of the picture; the one that it turns around if absent
   */
  boxFromClip(aspect, grid = this.#grid) {
    return boxFromClip(grid, this.camera, aspect);
  }
}
