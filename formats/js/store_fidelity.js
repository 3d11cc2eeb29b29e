/** Answers from fidelity.json (`volprep judge`): what a screen shows of a pyramid, and which level is enough. */

/** @typedef {{look: string, level: number, pixels_per_voxel: number, rmse: number, off: number, kept_contrast: number | null}} Judged */
/** @typedef {{levels: {level: number, spacing_mm_zyx: number[]}[], tolerance_rmse: number, least_kept_contrast: number, measured: Judged[]}} StoreFidelity */

/**
 * What a screen shows of a level. The worse one of the two nearest measured sizes counts; null where nothing like it
 * was measured: voxels larger on the screen than any that were.
 * @param {StoreFidelity} fidelity @param {string} look @param {number} level @param {number} mmPerPixel
 */
export function shown(fidelity, look, level, mmPerPixel) {
  const spacing = Math.min(...fidelity.levels[level].spacing_mm_zyx);
  const size = spacing / mmPerPixel;
  if (level === 0) return { pixels_per_voxel: size, rmse: 0, off: 0, kept_contrast: 1, within: true };
  const all = fidelity.measured.filter((each) => each.look === look && each.level === level);
  const sizes = all.map((each) => each.pixels_per_voxel);
  const above = Math.min(...sizes.filter((each) => each >= size * 0.999));
  if (!Number.isFinite(above)) return null;
  const below = Math.max(...sizes.filter((each) => each <= size * 1.001));
  const found = all.filter(({ pixels_per_voxel: each }) => each === above || each === below);
  const kept = found.flatMap(({ kept_contrast: each }) => (each === null ? [] : [each]));
  const rmse = Math.max(...found.map((each) => each.rmse));
  const off = Math.max(...found.map((each) => each.off));
  const least = kept.length ? Math.min(...kept) : null;
  const within = rmse <= fidelity.tolerance_rmse && (least ?? 1) >= fidelity.least_kept_contrast;
  return { pixels_per_voxel: size, rmse, off, kept_contrast: least, within };
}

/** The coarsest level that is within the tolerance on a screen. @param {StoreFidelity} fidelity @param {string} look @param {number} mmPerPixel */
export function levelFor(fidelity, look, mmPerPixel) {
  const enough = fidelity.levels.filter(({ level }) => shown(fidelity, look, level, mmPerPixel)?.within);
  return Math.max(...enough.map(({ level }) => level));
}
