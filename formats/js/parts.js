/** What the manifest says of what few packages have: mosaics, passes, empty-space skipping, editing, sub-volumes, meshes. */
import { PROGRAM, UNIFORMS, count, counts, number, path, positive, shadersOf, text, three, tuple, whole } from "./shapes.js";

const MOSAIC = { tile_shape_yx: tuple(2, count), slices: count, "gutter?": whole, "padding_yx?": tuple(2, whole), tiles_x: count, tiles_y: count, texture_shape_yx: tuple(2, count) };
// What more there is to passes is checked where they are drawn.
const PASS = { vertex: path, fragment: path, sampler: text, uniforms: UNIFORMS };
const DRAWN = { ...PROGRAM, "light?": { place_mm_xyz: three }, "before?": [PASS], "light_pass?": PASS };
/** @type {import("./shapes.js").ShapeObject} */
export const PARTS = {
  "together?": { name: text, transfers: [text] },
  textures: [{ "mosaic?": MOSAIC }],
  programs: [DRAWN],
  "skipping?": {
    "epsilon?": number,
    "tables?": [{ texture: text, level: whole, transfer: text, kind: text, block: count, blocks_zyx: counts, blocks_from_box_per_mm_xyz: three }],
    "ranges?": [{ texture: text, level: whole, block: count, blocks_zyx: counts }],
  },
  "editing?": { "histograms?": [{ level: count, file: path, reference_mm: positive, channel: text }] },
  "subvolumes?": { grid: path, "pieces?": [path], "programs?": [DRAWN] },
  "proxy?": {
    "meshes?": [{ transfer: text, level: whole, "file?": path, "triangles?": whole, "draco?": (v) => v === true || v === false, box_from_mesh_mm_xyz: tuple(3, positive) }],
    depth: path,
    "programs?": [DRAWN],
  },
};

/**
 * Files that parts use, and in which role.
 * @param {import("./types.js").Manifest} manifest
 * @returns {import("./shapes.js").Use[]}
 */
export function usesOf({ editing, subvolumes, proxy }) {
  return [
    ...(subvolumes ? shadersOf(subvolumes.programs ?? []) : []),
    ...(subvolumes?.pieces ?? []).map((file) => /** @type {import("./shapes.js").Use} */ ([file, "subvolume"])),
    ...(editing?.histograms ?? []).map(({ file }) => /** @type {import("./shapes.js").Use} */ ([file, "histogram"])),
    ...(subvolumes ? [/** @type {import("./shapes.js").Use} */ ([subvolumes.grid, "grid"])] : []),
    ...(proxy ? shadersOf(proxy.programs ?? []) : []),
    ...(proxy?.meshes ?? []).flatMap(({ file }) => (file ? [/** @type {import("./shapes.js").Use} */ ([file, "mesh"])] : [])),
    ...(proxy ? [/** @type {import("./shapes.js").Use} */ ([proxy.depth, "shader"])] : []),
  ];
}

/**
 * What parts contradict, or nothing.
 * @param {import("./types.js").Manifest} manifest
 * @returns {string | undefined}
 */
export function contradictionOf({ textures, skipping, proxy }) {
  const empty = proxy?.programs?.find((each) => !each.levels.length);
  if (empty) return `program ${empty.name} draws no level`;
  const torn = textures.find(({ mosaic, shape_zyx: [, ...shape] }) => mosaic?.texture_shape_yx.some((n, i) => n !== shape[i]));
  if (torn) return `texture ${torn.name} has another shape than its mosaic`;
  const names = new Set(textures.map((each) => each.name));
  const missing = [...(skipping?.tables ?? []), ...(skipping?.ranges ?? [])].find(({ texture }) => !names.has(texture));
  return missing && `empty-space skipping names the texture ${missing.texture}, which is not there`;
}
