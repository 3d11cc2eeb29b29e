/** Rules for parts that few packages have: mosaics, empty-space skipping, editing, sub-volumes, meshes. */
/**
 * Files that parts use, and in which role.
 * @param {import("./types.js").Manifest} manifest
 * @returns {import("./shapes.js").Use[]}
 */
export function usesOf({ editing, subvolumes, proxy }) {
  return [
    ...(subvolumes?.pieces ?? []).map((file) => /** @type {import("./shapes.js").Use} */ ([file, "subvolume"])),
    ...(editing?.histograms ?? []).map(({ file }) => /** @type {import("./shapes.js").Use} */ ([file, "histogram"])),
    ...(subvolumes ? [/** @type {import("./shapes.js").Use} */ ([subvolumes.grid, "grid"])] : []),
    ...(proxy?.meshes ?? []).flatMap(({ file }) =>
      file ? [/** @type {import("./shapes.js").Use} */ ([file, "mesh"])] : [],
    ),
  ];
}

/**
 * The first contradiction between parts of a manifest, or undefined.
 * @param {import("./types.js").Manifest} manifest
 * @returns {string | undefined}
 */
export function contradictionOf({ frames, pictures, textures, skipping, segments }) {
  for (const { name, drawings } of pictures) {
    const first = drawings.filter(({ frame }) => !frame).length;
    if (
      drawings.length !== first * (frames?.length || 1) ||
      drawings.some(({ frame = 0, level }, i) => frame !== Math.floor(i / first) || level !== drawings[i % first].level)
    )
      return `picture ${name} does not draw the same levels of each frame`;
  }
  const torn = textures.find(({ mosaic, shape_zyx: [, ...shape] }) =>
    mosaic?.texture_shape_yx.some((n, i) => n !== shape[i]),
  );
  if (torn) return `texture ${torn.name} has another shape than its mosaic`;
  const names = new Set(textures.map((each) => each.name));
  const missing = [...(skipping?.tables ?? []), ...(skipping?.ranges ?? [])].find(({ texture }) => !names.has(texture));
  if (missing) return `empty-space skipping names the texture ${missing.texture}, which is not there`;
  const segmentNames = new Set(segments?.segments.map((each) => each.name));
  const unknown = segments?.labels.flatMap((each) => each.segments ?? []).find((name) => !segmentNames.has(name));
  return unknown === undefined ? undefined : `a label is of the segment ${unknown}, which is not there`;
}
