/** Precomputed light of a volume that planes cut. spec/baked_light.md. */

/** @typedef {import("../core/drawing.js").Choice} Choice */
/** @typedef {import("../core/types.js").Manifest} Manifest */
/** @typedef {import("../core/types.js").Texture} Texture */
/** @typedef {readonly (readonly number[])[]} Planes a, b, c and d of each, box millimetres */

/** Largest difference of two equal planes: of a component of unit normals, and of distances in diagonals of the box. */
const SAME = 1e-4;

/**
 * @typedef {object} CutLight
 * @property {boolean} cut whether the light is that of the cut volume
 * @property {(choice: Choice) => Choice} of the same drawing with this light
 * @property {(planes: Planes, drawn: Choice) => boolean} sees whether it becomes another light than the one that was
 *   drawn, because a picture adds planes
 */

/**
 * The light of a cut; null if the package has no light of a cut volume.
 * @param {Manifest} manifest @param {Planes} own planes of the cut @param {number} more planes that each picture adds
 * @returns {CutLight | null}
 */
export function cutLight(manifest, own, more) {
  const texture = manifest.textures.find(({ light }) => light?.planes?.length);
  if (!texture) return null;
  // Planes of pictures are not known before one is drawn.
  let isKnown = !more;
  return {
    cut: !more && isCutAs(manifest, texture, own),
    of(choice) {
      return this.cut ? withCutLight(manifest, choice) : choice;
    },
    sees(planes, { textures }) {
      const before = isKnown ? this.cut : textures.some(({ light }) => light?.planes?.length);
      isKnown = true;
      this.cut = isCutAs(manifest, texture, [...own, ...planes]);
      return this.cut !== before;
    },
  };
}

/**
 * Whether planes cut the volume exactly as for the light of a texture. Planes that cut nothing of it do not count.
 * @param {Manifest} manifest @param {Texture} texture @param {Planes} planes
 */
function isCutAs({ grid }, { light }, planes) {
  const extent = [...grid.extent_mm_zyx].reverse();
  const near = SAME * Math.hypot(...extent);
  const cutting = planes
    .map((plane) => plane.map((x) => x / Math.hypot(...plane.slice(0, 3))))
    .filter(([a, b, c, d]) => d + [a, b, c].reduce((sum, each, i) => sum + Math.min(each * extent[i], 0), 0) < -near);
  const wanted = light?.planes ?? [];
  const finds = (/** @type {import("../core/types.js").ClipPlane} */ { normal, constant_mm: constant }) =>
    cutting.some(
      (plane) => normal.every((n, i) => Math.abs(n - plane[i]) <= SAME) && Math.abs(plane[3] - constant) <= near,
    );
  return cutting.length === wanted.length && wanted.every(finds);
}

/**
 * A choice with the light of the cut volume in place of that of the whole one, where there is such light.
 * @param {Manifest} manifest @param {Choice} choice @returns {Choice}
 */
function withCutLight(manifest, choice) {
  const found = manifest.textures.filter(({ light }) => light?.planes?.length);
  const textures = choice.textures.map((texture) => {
    const same = (/** @type {Texture} */ each) =>
      each.transfer === texture.transfer && (each.part ?? 0) === (texture.part ?? 0);
    return (texture.light && found.find(same)) ?? texture;
  });
  return { ...choice, textures };
}
