/** What the manifest says of parts of which few packages have any: empty-space skipping, editing, sub-volumes, meshes. */
import { PROGRAM, count, counts, number, path, positive, shadersOf, text, three, tuple, whole } from "./shapes.js";

/** @type {import("./shapes.js").ShapeObject} */
export const PARTS = {
  "skipping?": {
    "epsilon?": number,
    "tables?": [{ texture: text, level: whole, transfer: text, kind: text, block: count, blocks_zyx: counts, blocks_from_box_per_mm_xyz: three }],
    "ranges?": [{ texture: text, level: whole, block: count, blocks_zyx: counts }],
  },
  "editing?": { "histograms?": [{ level: count, file: path, reference_mm: positive, channel: text }] },
  "subvolumes?": { grid: path, "pieces?": [path], "programs?": [PROGRAM] },
  "proxy?": {
    "meshes?": [{ transfer: text, level: whole, "file?": path, "triangles?": whole, "draco?": (v) => v === true || v === false, box_from_mesh_mm_xyz: tuple(3, positive) }],
    depth: path,
    "programs?": [PROGRAM],
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
