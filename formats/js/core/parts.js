/** Rules for parts that few packages have: mosaics, empty-space skipping, editing, sub-volumes, meshes. */
/**
 * Files that parts use, and in which role.
 * @param {import("./types.js").Manifest} manifest
 * @returns {import("./shapes.js").Use[]}
 */
export function usesOf({ editing, subvolumes, on_demand: onDemand, proxy }) {
  return [
    ...(subvolumes?.pieces ?? []).map((file) => /** @type {import("./shapes.js").Use} */ ([file, "subvolume"])),
    ...(editing?.histograms ?? []).map(({ file }) => /** @type {import("./shapes.js").Use} */ ([file, "histogram"])),
    ...(subvolumes ? [/** @type {import("./shapes.js").Use} */ ([subvolumes.grid, "grid"])] : []),
    ...(onDemand ? [onDemand.index, onDemand.bricks] : []).map(
      (file) => /** @type {import("./shapes.js").Use} */ ([file, "bricks"]),
    ),
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
export function contradictionOf({ frames, pictures, textures, skipping, segments, ...rest }) {
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
  const names = new Set(textures.map((texture) => texture.name));
  const missing = [...(skipping?.tables ?? []), ...(skipping?.ranges ?? [])].find(({ texture }) => !names.has(texture));
  if (missing) return `empty-space skipping names the texture ${missing.texture}, which is not there`;
  const segmentNames = new Set(segments?.segments.map((segment) => segment.name));
  const unknown = segments?.labels.flatMap((label) => label.segments ?? []).find((name) => !segmentNames.has(name));
  return unknown === undefined ? bricksProblem(rest) : `a label is of the segment ${unknown}, which is not there`;
}

/**
 * Why bricks on demand do not belong to the volume, or undefined.
 * @param {Pick<import("./types.js").Manifest, "on_demand" | "grid" | "files">} manifest
 */
function bricksProblem({ on_demand: bricks, grid, files }) {
  if (!bricks || !grid) return undefined;
  let [all, last] = [0, 0];
  for (const [i, { factors_zyx: factors }] of bricks.levels.entries()) {
    const before = i ? bricks.levels[i - 1].factors_zyx : [1, 1, 1];
    if (factors.some((f, axis) => f !== before[axis] && !(i && f === 2 * before[axis])))
      return "the levels of its bricks do not begin at 1 and keep or double each factor";
    last = factors.reduce((n, f, axis) => n * Math.ceil(Math.ceil(grid.shape_zyx[axis] / f) / bricks.size), 1);
    all += last;
  }
  if (all > 2 ** 26 || files.find(({ path }) => path === bricks.index)?.size_bytes !== 24 * all)
    return `${bricks.index} is no record of 24 bytes for each brick`;
  const [z, y, x] = bricks.places_zyx;
  return last > z * y * x ? "its pool does not hold the coarsest level of bricks" : undefined;
}
