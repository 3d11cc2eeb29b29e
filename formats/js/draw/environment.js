/** The light around a volume, of packages whose precomputed light can be turned. spec/baked_light.md. */

/** @typedef {import("../core/types.js").Three} Three */
/** @typedef {import("../core/types.js").LightModel} LightModel */
/**
 * The light around a volume. Absent fields are the package's own.
 * @typedef {object} Environment
 * @property {Three} [sky] linear red, green and blue of light from above, the patient's head
 * @property {Three} [ground] of light from below
 * @property {{direction: Three, colour?: Three}[]} [suns] directions towards them in the patient's space (LPS)
 * @property {readonly number[]} [turn] rotation of all that, 3×3, row after row
 */

const ROOT = Math.sqrt(3);
/** Corners of a tetrahedron: the four environments of the textures are as bright as 1 + w · corner / √3. */
const CORNERS = [
  [1, 1, 1],
  [1, -1, -1],
  [-1, 1, -1],
  [-1, -1, 1],
];
const RGB = [0, 1, 2];

/** @param {unknown} numbers @param {number} count */
const areNumbers = (numbers, count) =>
  Array.isArray(numbers) && numbers.length === count && numbers.every(Number.isFinite);

/** Check an app's environment: returns the problem, or an empty text. @param {Environment} environment */
export function problemOf({ sky, ground, suns = [], turn }) {
  if (sky && !areNumbers(sky, 3)) return "sky is no colour of three numbers";
  if (ground && !areNumbers(ground, 3)) return "ground is no colour of three numbers";
  if (!Array.isArray(suns)) return "suns is no list";
  if (suns.some(({ direction, colour }) => !areNumbers(direction, 3) || (colour && !areNumbers(colour, 3))))
    return "a sun has no direction or colour of three numbers";
  if (suns.some(({ direction }) => !direction.some((x) => x !== 0))) return "the direction of a sun is zero";
  return turn && !isRotation(turn) ? "turn is no rotation of nine numbers" : "";
}

/** @param {readonly number[]} turn */
function isRotation(turn) {
  const row = (/** @type {number} */ i) => turn.slice(3 * i, 3 * i + 3);
  return (
    areNumbers(turn, 9) &&
    RGB.every((i) =>
      RGB.every((j) => Math.abs(row(i).reduce((sum, each, k) => sum + each * row(j)[k], 0) - Number(i === j)) < 1e-3),
    )
  );
}

/**
 * Light that comes from everywhere, and its change along x, y and z of the patient's space, each with three colours.
 * @param {LightModel} model @param {Environment | null} changed @param {boolean} [white] light of 1 from everywhere
 */
export function environmentOf(model, changed, white = false) {
  const environment = [0, 1, 2, 3].map((i) => [0, 0, 0].fill(white && i === 0 ? 1 : 0));
  if (white) return environment;
  const { sky = [1, 1, 1], ground = [1, 1, 1], suns = [], turn } = { ...model, ...changed };
  const add = (/** @type {readonly number[]} */ colour, /** @type {readonly number[]} */ direction, scale = 1) => {
    const along = turn
      ? RGB.map((i) => direction.reduce((sum, each, k) => sum + turn[3 * i + k] * each, 0))
      : direction;
    [1, ...along].forEach((each, i) => {
      for (const c of RGB) environment[i][c] += scale * each * colour[c];
    });
  };
  add(sky, [0, 0, 1], 0.5);
  add(ground, [0, 0, -1], 0.5);
  for (const { direction, colour = [1, 1, 1] } of suns) {
    const length = Math.hypot(...direction);
    add(
      colour,
      direction.map((x) => x / length),
    );
  }
  return environment;
}

/** The mat4 of a shader: each column is how much of one of the four environments there is. @param {number[][]} environment */
export function sharesOf([everywhere, ...along]) {
  return CORNERS.flatMap((corner) => [
    ...RGB.map((c) => (everywhere[c] + ROOT * corner.reduce((sum, each, i) => sum + each * along[i][c], 0)) / 4),
    0,
  ]);
}
