/** Parse the header of a KTX 2 file (spec/texture_files.md), and check it against the texture's entry in the manifest. */
import { VolpkgError } from "../core/error.js";
import { FORMATS } from "./formats.js";

/** @typedef {import("../core/types.js").Texture} Texture */
/**
 * Where a level lies in its file: first byte, bytes there, bytes of its texels, its size z, y, x; and whether these are
 * Zstandard frames of the texels.
 * @typedef {{offset: number, stored: number, size: number, shape: [number, number, number], packed: boolean}} Place
 */

const IDENTIFIER = [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];
const HEAD = 80;
/** Scheme of supercompression. */
const ZSTANDARD = 2;
/** Bytes that hold the entries of all levels that a texture can have. */
export const HEAD_BYTES = HEAD + 24 * 32;

/** Bytes of the texels of a level. @param {string} internal @param {readonly number[]} shape z, y, x */
export function texelBytes(internal, [z, y, x]) {
  const { block, bytes } = FORMATS[internal];
  return z * Math.ceil(y / block) * Math.ceil(x / block) * bytes;
}

/**
 * Where the texels of each level lie, the finest first.
 * @param {Uint8Array} head the first HEAD_BYTES of the file, or all of it
 * @param {number} fileBytes
 * @param {Texture[]} entries what the manifest says: several if they are mipmaps of one texture, the finest first
 * @returns {Place[]}
 */
export function readHead(head, fileBytes, entries) {
  const [{ file, gl, shape_zyx: shape }] = entries;
  /** @param {string} problem @returns {never} */
  const refuse = (problem) => {
    throw new VolpkgError("VP4030", { name: file, problem });
  };
  const levels = entries.length;
  const sized = HEAD + 24 * levels;
  if (head.length < Math.min(sized, HEAD_BYTES)) refuse(`it ends after ${head.length} bytes, in the header`);
  if (IDENTIFIER.some((byte, i) => head[i] !== byte)) refuse("it does not begin with the identifier of KTX 2");
  const view = new DataView(head.buffer, head.byteOffset, head.length);
  const word = (/** @type {number} */ i) => view.getUint32(12 + 4 * i, true);
  const long = (/** @type {number} */ at) => Number(view.getBigUint64(at, true));
  const { vk, typeSize, block, bytes } = FORMATS[gl.internal_format];
  const volume = gl.target === "TEXTURE_3D";
  const found = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(word).join(" ");
  const packed = word(8) === ZSTANDARD;
  const wanted = [vk, typeSize, shape[2], shape[1], volume ? shape[0] : 0, 0, 1, levels, packed ? ZSTANDARD : 0].join(
    " ",
  );
  if (found !== wanted)
    refuse(
      `its header says ${found} (vkFormat, typeSize, width, height, depth, layers, faces, levels, supercompression) and not ${wanted}`,
    );
  const [descriptorAt, descriptorSize, valuesAt, valuesSize] = [9, 10, 11, 12].map(word);
  let end = descriptorAt + descriptorSize;
  if (descriptorAt !== sized || descriptorSize < 44 || end > fileBytes)
    refuse(`its descriptor of ${descriptorSize} bytes at ${descriptorAt} is out of place`);
  if (long(64) || long(72)) refuse("it has supercompression data");
  if (valuesAt || valuesSize) {
    if (valuesAt !== end) refuse(`its ${valuesSize} bytes of key/value data at ${valuesAt} are out of place`);
    end += valuesSize;
  }
  const unit = packed ? 1 : bytes % 4 ? bytes * (bytes % 2 ? 4 : 2) : bytes;
  const places = entries.map((entry, level) => {
    const size = texelBytes(gl.internal_format, entry.shape_zyx);
    const halved = shape.map((n) => Math.max(1, n >> level));
    if (entry.shape_zyx.some((n, i) => n !== halved[i]))
      refuse(`its level ${level} has ${halved} texels, the manifest says ${entry.shape_zyx}`);
    const [offset, stored, unpacked] = [0, 8, 16].map((at) => long(HEAD + 24 * level + at));
    if (unpacked !== size || (packed ? stored < 1 || stored > size : stored !== size))
      refuse(`its level ${level} has ${stored} bytes, unpacked ${unpacked}, instead of ${size}`);
    return { offset, stored, size, shape: entry.shape_zyx, packed };
  });
  for (const { offset, stored } of [...places].reverse()) {
    if (offset % unit || offset < end)
      refuse(`the ${stored} bytes of texels at ${offset} overlap its header or a smaller level, or are not aligned`);
    end = offset + stored;
  }
  if (end !== fileBytes) refuse(`its texels end at ${end}, the file at ${fileBytes}`);
  if (block > 1 && volume) refuse("it is compressed and 3D");
  return places;
}
