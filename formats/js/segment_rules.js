/** Rules for segments, their labels, and the textures that hold them. spec/segments.md. */
import { FORMATS } from "./formats.js";

/** @typedef {import("./types.js").Manifest} Manifest */
/** @typedef {import("./types.js").Segments} Segments */
/** @typedef {import("./types.js").Texture} Texture */

/** Largest label with a byte for each voxel: the eighth bit is a flag. */
const LARGEST_SMALL_LABEL = 127;
/** Labels in a row of the table of looks, numbers in a row of label sets, and numbers in addition to the blocks. */
const [NARROWEST, WIDEST, SETS_ROW, SETS_ROOM] = [256, 2048, 2048, 1024];

/**
 * Contradictions of the segments of a manifest.
 * @param {Manifest} manifest @param {Texture[]} textures with the roles labels, looks and label-sets
 * @returns {Generator<string, void>}
 */
export function* segmentContradictions(manifest, textures) {
  const { segments } = manifest;
  if (!segments) {
    yield `texture ${textures[0].name} is of segments, which the package does not have`;
    return;
  }
  yield* labelContradictions(manifest, segments);
  for (const each of textures) {
    for (const problem of textureContradictions(manifest, segments, each)) yield `texture ${each.name} ${problem}`;
  }
}

/** @param {Manifest} manifest @param {Segments} record @returns {Generator<string, void>} */
function* labelContradictions({ channels, together }, { name: picture, transfers, segments, labels }) {
  const functions = new Set(channels.flatMap((each) => each.transfer_functions.map(({ name }) => name)));
  const transferOf = new Map(segments.map(({ name, transfer }) => [name, transfer]));
  if (functions.has(picture)) yield `${picture} names a transfer function and the picture of segments`;
  if (channels.length > 1 || together) yield "segments belong to a scan of one channel";
  if (transferOf.size < segments.length) yield "two segments have one name";
  const runs = labels.map(({ transfer }) => transfer).filter((each, i, all) => each !== all[i - 1]);
  const isOrdered = runs.length === transfers.length && runs.every((each, i) => each === transfers[i]);
  if (!isOrdered || [...runs, ...transferOf.values()].some((each) => !functions.has(each)))
    yield "the labels are not in the order of the transfer functions of segments";
  for (const { segments: own = [], transfer } of labels) {
    if (own.some((each) => !transferOf.has(each)) || new Set(own).size < own.length)
      yield `a label is of segments ${own.join(", ")}, which are not there, or not once`;
    if (own.length && transferOf.get(own[0]) !== transfer)
      yield `a label of ${own[0]} has another transfer function than this segment`;
  }
}

/** @param {Manifest} manifest @param {Segments} segments @param {Texture} texture @returns {Generator<string, void>} */
function* textureContradictions(manifest, { name: picture, labels }, texture) {
  const { role, gl, filter, transfer, level } = texture;
  if (filter !== "nearest" || gl.type !== "UNSIGNED_BYTE") yield `holds ${role}, but has a filter, or no bytes`;
  const { components } = FORMATS[gl.internal_format];
  if (role === "labels") {
    const held = manifest.channels[0].levels.find((each) => each.index === level);
    if (!held || !hasShape(texture, held.grid.shape_zyx))
      yield "holds labels, but neither as a 3D texture nor as a mosaic of the shape of its level";
    if (components !== (labels.length - 1 > LARGEST_SMALL_LABEL ? 2 : 1))
      yield `holds ${labels.length} labels in texels of ${gl.internal_format}`;
    return;
  }
  if (transfer !== picture) yield `holds ${role} of ${transfer}, which is not the picture of segments`;
  if (role === "label-sets") {
    yield* setContradictions(manifest, picture, texture);
    if (components !== 2) yield `holds numbers of 16 bits in texels of ${gl.internal_format}`;
    return;
  }
  let width = NARROWEST;
  while (width < labels.length && width < WIDEST) width *= 2;
  const isTable = `${texture.shape_zyx}` === `1,${Math.ceil(labels.length / width)},${width}`;
  if (!isTable || components !== 4 || level !== undefined)
    yield `is not the table of the looks of ${labels.length} labels`;
}

/** @param {Manifest} manifest @param {string} picture @param {Texture} texture @returns {Generator<string, void>} */
function* setContradictions({ textures, skipping }, picture, { role, level, shape_zyx: shape, gl }) {
  const table = skipping?.tables?.find((each) => each.transfer === picture && each.level === level);
  if (!table) {
    yield "holds the labels of blocks of a level without a skip table of segments";
    return;
  }
  const blocks = table.blocks_zyx.reduce((all, each) => all * each, 1);
  const rows = Math.ceil((blocks + Math.floor(blocks / 4) + SETS_ROOM) / SETS_ROW);
  if (`${shape}` !== `1,${rows},${SETS_ROW}` || gl.target !== "TEXTURE_2D")
    yield "has not the shape of the labels of the blocks of its level";
  if (textures.filter((each) => each.role === role && each.level === level).length > 1)
    yield "holds the labels of blocks of a level, as another texture does";
}

/** @param {Texture} texture @param {number[]} shape of the level, z, y, x */
function hasShape({ gl, shape_zyx: own, mosaic }, shape) {
  if (!mosaic) return gl.target === "TEXTURE_3D" && `${own}` === `${shape}`;
  const held = [mosaic.slices, ...mosaic.tile_shape_yx];
  return gl.target === "TEXTURE_2D" && `${held}` === `${shape}` && mosaic.slices_per_texel === 1;
}
