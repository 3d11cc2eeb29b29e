/** Formats of texels in files and in WebGL. spec/README.md. */

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
