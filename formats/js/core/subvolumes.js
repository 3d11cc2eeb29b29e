/** Level 0 in pieces: those around one point of the grid. spec/subvolumes.md. */
import { VolpkgError } from "./error.js";
import { uploadOf } from "../gl/formats.js";
import { toHalf } from "../gl/halves.js";
import { parseJson, schemaBreach } from "./strict.js";

/** @typedef {import("./drawing.js").Choice} Choice */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("./types.js").SubvolumeFiles} SubvolumeFiles */
/** @typedef {import("./types.js").Texture} Texture */
/** @typedef {import("./types.js").Three} Three */
/**
 * @typedef {object} SubvolumeGrid
 * @property {string} format
 * @property {Three} shape_zyx
 * @property {number} size
 * @property {number[][]} cuts_zyx
 * @property {number | null} [ghost]
 * @property {string} texture_format
 * @property {"2d" | "3d"} dimension
 * @property {Texture["gl"]} gl how WebGL takes a piece, which this reader adds
 * @property {"linear" | "nearest"} [filter]
 * @property {NonNullable<Texture["mosaic"]>} [mosaic]
 * @property {string | null} [whole]
 * @property {{minimum: number, file?: string, label?: number | null}[]} subvolumes
 * @property {{subvolumes: number[]}[]} points
 */

/** A voxel beyond every volume: a side without pieces is never reached. */
const NOWHERE = 1e9;

/** Reads and checks the grid of a package. @param {Package} pack @param {AbortSignal} [signal] @returns {Promise<SubvolumeGrid>} */
export async function readGrid(pack, signal) {
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
  grid.gl = uploadOf(grid.texture_format, grid.dimension, pack.manifest.profile.api);
  for (const problem of contradictions(grid)) refuse(problem);
  if (volume.shape_zyx.some((n, i) => n !== grid.shape_zyx[i])) refuse("it has another shape than the volume");
  const { pieces = [], whole = null } = /** @type {Partial<SubvolumeFiles>} */ (subvolumes ?? {});
  const files = grid.subvolumes.flatMap((/** @type {{file?: string}} */ { file }) => file ?? []);
  if (files.join() !== pieces.join() || (grid.whole ?? null) !== whole)
    refuse("it names other files than the manifest");
  return grid;
}

/** Components of a texel. @param {Texture["gl"]} gl */
const componentsOf = ({ format }) =>
  ({ LUMINANCE: 1, RED: 1, LUMINANCE_ALPHA: 2, RG: 2, RGB: 3, RGBA: 4 })[String(format)] ?? 0;

/** Every way in which a grid contradicts itself. @param {SubvolumeGrid} grid @returns {Generator<string, void>} */
function* contradictions(grid) {
  const { cuts_zyx, ghost, gl, mosaic, points, shape_zyx, size, subvolumes } = grid;
  if (grid.format !== "volpkg-subvolumes" || cuts_zyx.length !== 3) return yield "it is no grid of sub-volumes";
  for (const [axis, cuts] of cuts_zyx.entries()) {
    const last = shape_zyx[axis] - 1;
    const inOrder = cuts.every((cut, i) => !i || cut > cuts[i - 1]) || (last === 0 && cuts.join() === "0,0");
    const inSize = spansOf(cuts, ghost).every(([low, high]) => high - low < size);
    if (cuts.length < 2 || cuts[0] !== 0 || cuts[cuts.length - 1] !== last || !inOrder || !inSize)
      return yield `the cuts along ${"zyx"[axis]} do not lead from 0 to ${last} in steps below ${size}`;
  }
  const counted = (/** @type {number} */ more) => cuts_zyx.reduce((n, cuts) => n * (cuts.length - 1 + more), 1);
  if (subvolumes.length !== counted(0)) yield `it has ${subvolumes.length} sub-volumes instead of ${counted(0)}`;
  if (points.length !== counted(1)) yield `it has ${points.length} points instead of ${counted(1)}`;
  if (points.some((point) => point.subvolumes.some((number) => number >= subvolumes.length)))
    yield "a point names a sub-volume that is not there";
  if ((gl.target === "TEXTURE_3D") === Boolean(mosaic)) yield "its pieces are mosaics in 3D, or in 2D without one";
  const most = cuts_zyx.map((cuts) =>
    spansOf(cuts, ghost).reduce((most, [low, high]) => Math.max(most, high - low + 1), 0),
  );
  if (mosaic && !holdsPieces(mosaic, gl, most)) yield "its mosaic does not hold every piece in one texture";
}

/**
 * Whether a mosaic of one texture holds every piece. Overlapping slices need a tile that begins with the last one.
 * @param {NonNullable<Texture["mosaic"]>} mosaic @param {Texture["gl"]} gl @param {number[]} most voxels of a piece
 */
function holdsPieces(mosaic, gl, most) {
  const { order = "interleaved", slices, slices_per_texel: each, tile_shape_yx: tile, texture_shape_yx: size } = mosaic;
  const { gutter = 0, padding_yx = [0, 0], tiles_x, tiles_y, textures = 1, components_per_voxel = 1 } = mosaic;
  const overlaps = order === "overlapping";
  const [depth, ...sides] = most;
  const count = overlaps && each === 4 ? Math.max(1, Math.ceil((slices - 1) / 3)) : Math.ceil(slices / each);
  const components = componentsOf(gl);
  return (
    textures === 1 &&
    components_per_voxel === ([2, 3].includes(components) ? components : 1) &&
    each * components_per_voxel === components &&
    (each === 4 || order === "interleaved") &&
    sides.every((side, i) => tile[i] >= side) &&
    slices >= depth &&
    count <= tiles_x * tiles_y &&
    count * (overlaps ? 3 : each) >= depth &&
    [tiles_y, tiles_x].every((tiles, i) => tiles * (tile[i] + 2 * gutter + padding_yx[i]) <= size[i])
  );
}

/**
 * The drawing of the pieces around a point, with all its inputs.
 * @param {Package} pack @param {string} picture @param {number | {choose: Function}} point or bricks on demand
 * @param {typeof import("./drawing.js").namedBy} namedBy finds the program and the textures @param {AbortSignal} [signal]
 * @returns {Promise<Choice>}
 */
export async function chooseBlock(pack, picture, point, namedBy, signal) {
  if (typeof point === "object") return point.choose(pack, picture, namedBy);
  const { pictures, grid: volume } = pack.manifest;
  const { pieces } = pictures.find((each) => each.name === picture) ?? {};
  const refuse = (/** @type {string} */ known) =>
    new VolpkgError("VP5018", {
      package: pack.name,
      level: `the pieces around point ${point}`,
      transfer: picture,
      known,
    });
  if (!pieces) throw refuse("nothing around a point: the package has no sub-volumes for it");
  const grid = await readGrid(pack, signal);
  const counts = grid.cuts_zyx.map((cuts) => cuts.length);
  const [, ny, nx] = counts;
  if (!(Number.isSafeInteger(point) && point >= 0 && point < counts[0] * ny * nx))
    throw refuse(`points 0 to ${counts[0] * ny * nx - 1}`);
  const place = [Math.floor(point / (nx * ny)), Math.floor(point / nx) % ny, point % nx];
  const sides = place.map((at, axis) => sidesOf(at, grid.cuts_zyx[axis], grid.ghost)).reverse();
  const spacing = [...volume.spacing_mm_zyx].reverse();
  const shape = [...grid.shape_zyx].reverse();
  const ofSides = (/** @type {(side: ReturnType<typeof sidesOf>, axis: number) => number} */ value) => sides.map(value);
  /** @type {Record<string, Uint8Array>} */
  const texels = Object.create(null);
  const { program, textures } = namedBy(pack, pieces, (name) => {
    const part = /^subvolume-([0-7])$/.exec(name)?.[1];
    if (part === undefined) return undefined;
    const { texture, constant } = piece(grid, place, +part);
    if (constant) texels[texture.name] = constant;
    return texture;
  });
  const per = /** @type {Three} */ (shape.map((n, i) => 1 / (n * spacing[i])));
  return {
    picture,
    program,
    level: { index: 0, factors_zyx: [1, 1, 1], grid: volume, filter: "none" },
    stepMm: pieces.step_mm,
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

/** The first and the last voxel of each piece along an axis. @param {number[]} cuts @param {number | null} [ghost] layers beyond the cuts, where the volume goes on */
function spansOf(cuts, ghost) {
  const more = ghost ?? 0;
  const end = cuts[cuts.length - 1];
  return cuts.slice(1).map((cut, i) => [Math.max(cuts[i] - more, 0), Math.min(cut + more, end)]);
}

/** Along an axis: the first and the last voxel of the pieces below and above a point, and the block that they fill. @param {number} at @param {number[]} cuts @param {number | null} [ghost] */
function sidesOf(at, cuts, ghost) {
  const spans = spansOf(cuts, ghost);
  const last = cuts.length - 1;
  const [below, above] = [at > 0, at < last];
  const [first, final] = [Math.max(at - 1, 0), Math.min(at + 1, last)];
  return {
    split: below && above ? cuts[at] + 0.5 : below ? NOWHERE : -NOWHERE,
    low: spans[below ? at - 1 : at],
    high: spans[above ? at : at - 1],
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
  const spans = grid.cuts_zyx.map((cuts) => spansOf(cuts, grid.ghost));
  const counts = spans.map(({ length }) => length);
  const there = at.every((each, axis) => each >= 0 && each < counts[axis]);
  /** @type {SubvolumeGrid["subvolumes"][number]} */
  const found = there ? grid.subvolumes[at[2] + counts[2] * (at[1] + counts[1] * at[0])] : { minimum: 0 };
  const shape = !found.file
    ? [1, 1, 1]
    : grid.mosaic
      ? [1, ...grid.mosaic.texture_shape_yx]
      : at.map((each, axis) => spans[axis][each][1] - spans[axis][each][0] + 1);
  const name = `subvolume-${part}`;
  /** @type {Texture} */
  const texture = {
    name,
    role: "volume",
    file: found.file ?? name,
    shape_zyx: /** @type {Three} */ (shape),
    format: grid.texture_format,
    dimension: grid.dimension,
    gl: grid.gl,
    filter: grid.filter,
    level: 0,
    part,
  };
  if (found.file) return { texture };
  const code = grid.gl.type === "HALF_FLOAT" ? toHalf(found.minimum / 65535) : found.minimum;
  const components = componentsOf(grid.gl);
  const { label = 0 } = found;
  // A value and a label, or a value for each slice of a texel.
  const codes = [2, 3].includes(components)
    ? [code, (label ?? 0) & 0xff, (label ?? 0) >> 8].slice(0, components)
    : Array(components || 1).fill(code);
  return {
    texture,
    constant:
      grid.gl.type === "UNSIGNED_BYTE" ? Uint8Array.from(codes) : new Uint8Array(Uint16Array.from(codes).buffer),
  };
}
