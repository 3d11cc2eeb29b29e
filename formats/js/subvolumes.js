/** Level 0 in pieces: those around one point of the grid. SPEC section 18. */
import { VolpkgError } from "./error.js";
import { toHalf } from "./halves.js";
import { parseJson, schemaBreach } from "./strict.js";

/** @typedef {import("./choose.js").Choice} Choice */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("./types.js").Texture} Texture */
/** @typedef {import("./types.js").Three} Three */
/**
 * @typedef {object} SubvolumeGrid
 * @property {string} format
 * @property {Three} shape_zyx
 * @property {number[][]} cuts_zyx
 * @property {Texture["gl"]} gl
 * @property {"linear" | "nearest"} [filter]
 * @property {NonNullable<Texture["mosaic"]>} [mosaic]
 * @property {{minimum: number, file?: string}[]} subvolumes
 */

/** A voxel beyond every volume: a side without pieces is never reached. */
const NOWHERE = 1e9;

/** @param {Package} pack @param {AbortSignal} [signal] @returns {Promise<SubvolumeGrid>} */
async function readGrid(pack, signal) {
  const { subvolumes, grid: volume } = pack.manifest;
  const path = subvolumes?.grid ?? "";
  /** @param {string} problem @returns {never} */
  const refuse = (problem) => {
    throw new VolpkgError("VP4011", { path: pack.name, problem: `${path}: ${problem}` });
  };
  /** @type {any} */
  let grid;
  try {
    grid = parseJson(await pack.read(path, { signal }));
  } catch (error) {
    if (error instanceof VolpkgError || signal?.aborted) throw error;
    refuse(`it is not JSON: ${/** @type {Error} */ (error).message}`);
  }
  const problem = schemaBreach(grid, "SubvolumeGrid", "");
  if (problem) refuse(problem);
  const isFlat = grid.gl.target === "TEXTURE_2D";
  if (grid.format !== "volpkg-subvolumes" || grid.cuts_zyx.length !== 3 || isFlat !== Boolean(grid.mosaic))
    refuse("it is no grid of sub-volumes");
  if (volume.shape_zyx.some((n, i) => n !== grid.shape_zyx[i])) refuse("it has another shape than the volume");
  grid.cuts_zyx.forEach((/** @type {number[]} */ cuts, /** @type {number} */ axis) => {
    const last = grid.shape_zyx[axis] - 1;
    const inOrder = cuts.slice(1).every((cut, i) => cut > cuts[i]) || (last === 0 && cuts.join() === "0,0");
    if (cuts.length < 2 || cuts[0] !== 0 || cuts[cuts.length - 1] !== last || !inOrder)
      refuse(`the cuts along ${"zyx"[axis]} do not lead from 0 to ${last}`);
  });
  const count = grid.cuts_zyx.reduce(
    (/** @type {number} */ product, /** @type {number[]} */ cuts) => product * (cuts.length - 1),
    1,
  );
  if (grid.subvolumes.length !== count) refuse(`it has ${grid.subvolumes.length} sub-volumes instead of ${count}`);
  return grid;
}

/**
 * The program of the pieces around a point, with all its inputs.
 * @param {Package} pack @param {string} picture @param {number} point
 * @param {typeof import("./choose.js").textureOf} textureOf finds all other textures @param {AbortSignal} [signal]
 * @returns {Promise<Choice>}
 */
export async function chooseBlock(pack, picture, point, textureOf, signal) {
  const { subvolumes, grid: volume } = pack.manifest;
  const program = subvolumes?.programs?.find((each) => each.transfer === picture);
  const refuse = (/** @type {string} */ known) =>
    new VolpkgError("VP5018", { package: pack.name, level: `around point ${point}`, transfer: picture, known });
  if (!program) throw refuse("nothing around a point: the package has no sub-volumes for it");
  const grid = await readGrid(pack, signal);
  const counts = grid.cuts_zyx.map((cuts) => cuts.length);
  const [, ny, nx] = counts;
  if (!(Number.isSafeInteger(point) && point >= 0 && point < counts[0] * ny * nx))
    throw refuse(`points 0 to ${counts[0] * ny * nx - 1}`);
  const place = [Math.floor(point / (nx * ny)), Math.floor(point / nx) % ny, point % nx];
  const sides = place.map((at, axis) => sidesOf(at, grid.cuts_zyx[axis])).reverse();
  const spacing = [...volume.spacing_mm_zyx].reverse();
  const shape = [...grid.shape_zyx].reverse();
  const ofSides = (/** @type {(side: ReturnType<typeof sidesOf>, axis: number) => number} */ value) => sides.map(value);
  /** @type {Record<string, Uint8Array>} */
  const texels = Object.create(null);
  const textures = program.samplers.map((sampler) => {
    if (sampler.role !== "subvolume") return textureOf(pack, program, sampler, 0);
    const { texture, constant } = piece(grid, place, sampler.part ?? 0);
    if (constant) texels[texture.name] = constant;
    return texture;
  });
  const per = /** @type {Three} */ (shape.map((n, i) => 1 / (n * spacing[i])));
  return {
    program,
    level: { index: 0, factors_zyx: [1, 1, 1], grid: volume, texture_from_box_per_mm_xyz: per, filter: "none" },
    textures,
    texels,
    values: {
      texture_from_box: per,
      blocks_from_box: [0, 0, 0],
      mipmap: 0,
      block_low_mm: ofSides(({ begins }, i) => begins * spacing[i]),
      block_high_mm: ofSides(({ ends }, i) => ends * spacing[i]),
      split_voxel: ofSides(({ split }) => split),
      low_start_voxel: ofSides(({ low }) => low[0]),
      low_size_voxels: ofSides(({ low }) => low[1] - low[0] + 1),
      high_start_voxel: ofSides(({ high }) => high[0]),
      high_size_voxels: ofSides(({ high }) => high[1] - high[0] + 1),
    },
  };
}

/** Along an axis: the first and the last voxel of the pieces below and above a point, and the block that they fill. @param {number} at @param {number[]} cuts */
function sidesOf(at, cuts) {
  const last = cuts.length - 1;
  const [below, above] = [at > 0, at < last];
  const [first, final] = [Math.max(at - 1, 0), Math.min(at + 1, last)];
  return {
    split: below && above ? cuts[at] + 0.5 : below ? NOWHERE : -NOWHERE,
    low: cuts.slice(below ? at - 1 : at).slice(0, 2),
    high: cuts.slice(above ? at : at - 1).slice(0, 2),
    begins: first === 0 ? 0 : cuts[first] + 0.5,
    ends: final === last ? cuts[last] + 1 : cuts[final] + 0.5,
  };
}

/**
 * The texture of one of the eight pieces around a place; a constant voxel if it is empty or not there.
 * @param {SubvolumeGrid} grid @param {number[]} place z, y, x @param {number} part
 * @returns {{texture: Texture, constant?: Uint8Array}}
 */
function piece(grid, place, part) {
  const at = place.map((each, axis) => each - 1 + ((part >> (2 - axis)) & 1));
  const counts = grid.cuts_zyx.map((cuts) => cuts.length - 1);
  const there = at.every((each, axis) => each >= 0 && each < counts[axis]);
  const found = there ? grid.subvolumes[at[2] + counts[2] * (at[1] + counts[1] * at[0])] : { minimum: 0 };
  const shape = !found.file
    ? [1, 1, 1]
    : grid.mosaic
      ? [1, ...grid.mosaic.texture_shape_yx]
      : at.map((each, axis) => grid.cuts_zyx[axis][each + 1] - grid.cuts_zyx[axis][each] + 1);
  const name = `subvolume-${part}`;
  /** @type {Texture} */
  const texture = {
    name,
    role: "volume",
    file: found.file ?? name,
    shape_zyx: /** @type {Three} */ (shape),
    gl: grid.gl,
    filter: grid.filter,
    level: 0,
    part,
  };
  if (found.file) return { texture };
  const code = grid.gl.type === "HALF_FLOAT" ? toHalf(found.minimum / 65535) : found.minimum;
  const codes = Array(grid.gl.format === "RGBA" ? 4 : 1).fill(code);
  return {
    texture,
    constant:
      grid.gl.type === "UNSIGNED_BYTE" ? Uint8Array.from(codes) : new Uint8Array(Uint16Array.from(codes).buffer),
  };
}
