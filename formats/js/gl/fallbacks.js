/** Substitutes for formats that a device draws wrongly, with conversions of their texels. */
import { FORMATS, finerSize, fromHalf } from "./formats.js";
import { toHalf } from "./halves.js";

/** @typedef {import("./textures.js").Form} Form */
/** @typedef {import("../core/types.js").Texture} Texture */

FORMATS.RGBA32F = { ...FORMATS.RGBA16F, vk: 109, typeSize: 4, bytes: 16, type: "FLOAT" };

/** Texels along an axis of a table that is not filtered. */
const FINEST = 4096;
const MOST_TEXELS = 1 << 20;

/** @param {Uint8Array} bytes */
const words = (bytes) => new Uint16Array(bytes.buffer, bytes.byteOffset, bytes.length / 2);

/** Half floats of all 16-bit codes, once one is needed. @type {Uint16Array | undefined} */
let halves;

const halvesOfCodes = () => Uint16Array.from({ length: 65536 }, (_, code) => toHalf(code / 65535));

/** Formats that can replace a texture's own format, the best one first. @param {Texture} texture @returns {Form[]} */
export function others({ gl: { internal_format: internal, target }, filter, shape_zyx: [, rows, columns] }) {
  if (internal === "RGBA16F" && target === "TEXTURE_2D") {
    const most = rows > 1 ? Math.sqrt(MOST_TEXELS) : FINEST;
    const finer = Math.max(1, Math.floor(most / columns));
    const note = "tables are not filtered by the device";
    return ["RGBA16F", "RGBA32F"].map((wide) => ({
      internal: wide,
      finer,
      note,
      convert: (bytes, width) => interpolated(words(bytes), width, finer, wide),
    }));
  }
  // Labels are codes: rounded, they would be other labels.
  if (filter === "nearest") return [];
  if (internal === "R16_EXT") {
    return [
      {
        internal: "R16F",
        note: "11 of 16 bits",
        convert: (bytes) => words(bytes).map((code) => (halves ??= halvesOfCodes())[code]),
      },
      {
        internal: "R8",
        note: "8 of 16 bits",
        convert: (bytes) => Uint8Array.from(words(bytes), (code) => Math.round(code / 257)),
      },
    ];
  }
  if (internal === "R16F")
    return [
      {
        internal: "R8",
        note: "8 of 11 bits",
        convert: (bytes) => Uint8Array.from(words(bytes), (half) => Math.round(255 * fromHalf(half))),
      },
    ];
  return [];
}

/**
 * A table of half floats with `finer` texels for each of its own, linear between their centres.
 * @param {Uint16Array} texels RGBA @param {number} width @param {number} finer @param {string} internal
 */
function interpolated(texels, width, finer, internal) {
  const height = texels.length / 4 / width;
  const [rows, columns] = [height, width].map((n) => places(n, finer));
  const values = new Float32Array(4 * rows.length * columns.length);
  const value = Float32Array.from(texels, fromHalf);
  let at = 0;
  for (const [y0, y1, fy] of rows) {
    for (const [x0, x1, fx] of columns) {
      for (let c = 0; c < 4; c++) {
        const [a, b, d, e] = [y0 * width + x0, y0 * width + x1, y1 * width + x0, y1 * width + x1].map(
          (i) => value[4 * i + c],
        );
        values[at++] = (a + (b - a) * fx) * (1 - fy) + (d + (e - d) * fx) * fy;
      }
    }
  }
  return internal === "RGBA16F" ? Uint16Array.from(values, (value) => toHalf(Math.min(value, 65504))) : values;
}

/** Of each texel along an axis: the two of the table beside it, and how far it is from the first. @param {number} n @param {number} finer */
function places(n, finer) {
  return Array.from({ length: finerSize(n, finer) }, (_, i) => {
    const at = n > 1 ? Math.min(Math.max((i + 0.5) / finer - 0.5, 0), n - 1) : 0;
    const low = Math.floor(at);
    return [low, Math.min(low + 1, n - 1), at - low];
  });
}
