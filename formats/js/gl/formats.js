/** Formats of texels in files and in WebGL. spec/README.md. */
import { has } from "../core/shapes.js";

/**
 * @typedef {object} Format
 * @property {number} vk vkFormat in the file
 * @property {number} typeSize bytes of a component
 * @property {number} bytes of a texel, or of a block of texels
 * @property {number} block width and height of a block; 1 if texels are not compressed
 * @property {string} [format] pixel format for the upload
 * @property {string} [type] pixel type for the upload
 * @property {number} components
 * @property {string} [extension] without which WebGL 2 does not have it
 * @property {{texels: number[], red: number}} [sample] a block, and the red that it holds
 */

/** @param {number} vk @param {string} format @param {number} components @param {string} [type] @param {string} [extension] @returns {Format} */
function plain(vk, format, components, type = "UNSIGNED_BYTE", extension) {
  const typeSize = type.endsWith("BYTE") ? 1 : 2;
  return { vk, typeSize, bytes: typeSize * components, block: 1, format, type, components, extension };
}

/** By the name of the internal format; blocks.js and fallbacks.js add rarer ones. @type {Record<string, Format>} */
export const FORMATS = {
  LUMINANCE: plain(9, "LUMINANCE", 1),
  LUMINANCE_ALPHA: plain(16, "LUMINANCE_ALPHA", 2),
  RGB: plain(23, "RGB", 3),
  RGBA: plain(37, "RGBA", 4),
  R8: plain(9, "RED", 1),
  RG8: plain(16, "RG", 2),
  RGB8: plain(23, "RGB", 3),
  RGBA8: plain(37, "RGBA", 4),
  RGB8_SNORM: plain(24, "RGB", 3, "BYTE"),
  RGBA8_SNORM: plain(38, "RGBA", 4, "BYTE"),
  SRGB8_ALPHA8: plain(43, "RGBA", 4),
  R16_EXT: plain(70, "RED", 1, "UNSIGNED_SHORT", "EXT_texture_norm16"),
  R16F: plain(76, "RED", 1, "HALF_FLOAT"),
  RGBA16F: plain(97, "RGBA", 4, "HALF_FLOAT"),
};

/** Internal formats of the formats of textures: of OpenGL ES 3, and of 2 if that differs. @type {Record<string, string[]>} */
export const INTERNAL = {
  r8unorm: ["R8", "LUMINANCE"],
  rg8unorm: ["RG8", "LUMINANCE_ALPHA"],
  rgb8unorm: ["RGB8", "RGB"],
  rgba8unorm: ["RGBA8", "RGBA"],
  rgb8snorm: ["RGB8_SNORM"],
  rgba8snorm: ["RGBA8_SNORM"],
  "rgba8unorm-srgb": ["SRGB8_ALPHA8"],
  r16unorm: ["R16_EXT"],
  r16float: ["R16F"],
  rgba16float: ["RGBA16F"],
  "palette8-rgba8unorm": ["PALETTE8_RGBA8_OES"],
};

/**
 * How WebGL takes a texture.
 * @param {string} format @param {"2d" | "3d"} dimension @param {string} api of the profile
 * @returns {import("../core/types.js").GlFormat}
 */
export function uploadOf(format, dimension, api) {
  const [sized, unsized = sized] = has(INTERNAL, format) ? INTERNAL[format] : [""];
  const internal = api === "es3.0" ? sized : unsized;
  const { format: pixels, type } = FORMATS[internal] ?? {};
  return { target: dimension === "3d" ? "TEXTURE_3D" : "TEXTURE_2D", internal_format: internal, format: pixels, type };
}

/** @typedef {WebGLRenderingContext | WebGL2RenderingContext} Gl */

/** @param {Gl} gl @returns {gl is WebGL2RenderingContext} */
export const isWebGl2 = (gl) => "texImage3D" in gl;

/**
 * The number of a constant of WebGL or of an extension; undefined if the context does not have it.
 * @param {Gl} gl @param {string} name @param {string} [extension]
 * @returns {number | undefined}
 */
export function constant(gl, name, extension) {
  return /** @type {any} */ (extension ? gl.getExtension(extension) : gl)?.[name];
}

/** Linear light of an encoded sRGB component. @param {number} encoded 0 to 1 */
export const linearOf = (encoded) => (encoded <= 0.04045 ? encoded / 12.92 : ((encoded + 0.055) / 1.055) ** 2.4);

/** @param {number} half bits of a half float */
export function fromHalf(half) {
  const exponent = (half >> 10) & 31;
  const fraction = half & 1023;
  const size =
    exponent === 31
      ? fraction
        ? NaN
        : Infinity
      : exponent
        ? 2 ** (exponent - 15) * (1 + fraction / 1024)
        : fraction * 2 ** -24;
  return half & 0x8000 ? -size : size;
}

/** Texels along an axis of a table with `finer` texels for each entry. @param {number} n @param {number} finer */
export const finerSize = (n, finer) => (n > 1 ? n * finer : n);
