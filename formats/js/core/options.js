/** How a renderer is made, and how it is asked for a picture. */

/** @typedef {readonly [x: number, y: number, width: number, height: number]} Viewport */
/**
 * Depth of opaque objects, at the size of the picture.
 * @typedef {object} Depth
 * @property {WebGLTexture} texture
 * @property {boolean} [reversed] whether 1 is the near plane
 * @property {readonly [slope: number, offset: number, log2: number]} [scale] if the depth has other near and far
 *   planes than the picture: its clip coordinate is slope · x + offset, where x is 1 - depth, depth itself if it is
 *   reversed, or 1 / (2^(log2 · depth) - 1) if log2 is not 0
 */
/**
 * Where and how a picture is drawn.
 * @typedef {object} How
 * @property {ArrayLike<number>} boxFromClip 16 numbers, column by column, from clip coordinates to box millimetres
 * @property {Viewport} [viewport] of the target, or size of the own picture; the whole canvas if absent
 * @property {WebGLFramebuffer | null} [target] null is the canvas; a picture of its own, which `present` shows, if
 *   absent
 * @property {object} [keep] key of the own picture, for apps that need several at a time
 * @property {Depth} [depth] of opaque objects, after `setClip` or the option `depth` asked for it
 * @property {readonly (readonly number[])[]} [planes] additional clipping planes, like the planes of `setClip`; the
 *   first picture with more planes than before is late, because its shader is compiled first
 * @property {boolean} [blend] over the existing picture, in a linear target; replaces it if absent
 * @property {Viewport} [part] of the viewport, which is drawn; the rest is kept. All of it if absent
 * @property {boolean} [moving] whether the picture may be coarser; by default the state of `interacting`
 */
/**
 * @typedef {object} RendererOptions
 * @property {string} [program] which picture: the name of a transfer function, or of several channels together; the
 *   first if absent
 * @property {number} [level] the finest that fits if absent
 * @property {number} [maxTextureBytes] limit of the bytes of all textures; that of the package's profile if absent
 * @property {import("../draco.js").DecodeDraco} [decodeDraco] unpacks meshes that are compressed with Draco; they are
 *   left out if absent
 * @property {number} [frameMs] how long a picture may take while the camera moves, 33 if absent; with Infinity all are
 *   drawn in full
 * @property {number} [frameBytes] of textures of other frames of a time series that stay on the GPU, 120 MB if absent
 * @property {boolean} [relight] whether ambient occlusion is computed again, in the background, after an edit of a
 *   transfer function with precomputed light; without it such light is left out
 * @property {boolean} [depth] whether rays always end at the depth that `draw` is given
 * @property {AbortSignal} [signal] frees everything
 * @property {(work: () => void) => void} [around] called with each use of the context, for apps that keep state of
 *   their own
 * @property {(error: unknown) => void} [onError] called with errors in the background: a finer level, a lost context
 */
export {};
