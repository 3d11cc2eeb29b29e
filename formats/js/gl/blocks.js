/** Formats of compressed blocks, each with a sample block to test a device. spec/texture_files.md. */
import { FORMATS, INTERNAL } from "./formats.js";

/** @param {number} vk @param {number} block @param {number} bytes @param {number} components @param {string} extension @param {number[]} texels @param {number} [red] @returns {import("./formats.js").Format} */
const packed = (vk, block, bytes, components, extension, texels, red = 0.5) => ({
  vk,
  typeSize: 1,
  bytes,
  block,
  components,
  extension,
  sample: { texels, red },
});

const ETC = "WEBGL_compressed_texture_etc";
const ASTC = "WEBGL_compressed_texture_astc";
/** sRGB: a half is darker when it is decoded. */
const HALF_SRGB = ((0.5 + 0.055) / 1.055) ** 2.4;
const VOID_EXTENT = [0xfc, 0xfd, 255, 255, 255, 255, 255, 255, 0, 128, 0, 128, 0, 128, 0, 128];

Object.assign(FORMATS, {
  COMPRESSED_R11_EAC: packed(153, 4, 8, 1, ETC, [128, 0, 0, 0, 0, 0, 0, 0]),
  COMPRESSED_RGBA8_ETC2_EAC: packed(
    151,
    4,
    16,
    4,
    ETC,
    [128, 0, 0, 0, 0, 0, 0, 0, 128, 128, 128, 2, 0, 0, 0, 0],
    134 / 255,
  ),
  COMPRESSED_RGBA_ASTC_4x4_KHR: packed(157, 4, 16, 1, ASTC, VOID_EXTENT),
  COMPRESSED_RGBA_ASTC_5x5_KHR: packed(161, 5, 16, 1, ASTC, VOID_EXTENT),
  COMPRESSED_RGBA_ASTC_6x6_KHR: packed(165, 6, 16, 1, ASTC, VOID_EXTENT),
  COMPRESSED_RGBA_ASTC_8x8_KHR: packed(171, 8, 16, 1, ASTC, VOID_EXTENT),
  COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR: packed(158, 4, 16, 4, ASTC, VOID_EXTENT, HALF_SRGB),
});

Object.assign(INTERNAL, {
  "eac-r11unorm": ["COMPRESSED_R11_EAC"],
  "etc2-rgba8unorm": ["COMPRESSED_RGBA8_ETC2_EAC"],
  "astc-4x4-unorm": ["COMPRESSED_RGBA_ASTC_4x4_KHR"],
  "astc-5x5-unorm": ["COMPRESSED_RGBA_ASTC_5x5_KHR"],
  "astc-6x6-unorm": ["COMPRESSED_RGBA_ASTC_6x6_KHR"],
  "astc-8x8-unorm": ["COMPRESSED_RGBA_ASTC_8x8_KHR"],
  "astc-4x4-unorm-srgb": ["COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR"],
});
