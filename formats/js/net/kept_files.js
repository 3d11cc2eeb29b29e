/** Small files that are read again with each change of an app. */
import { VolpkgError } from "../core/messages.js";
import { readHead } from "../gl/ktx2.js";

/** @typedef {import("../core/package.js").Package} Package */

/** @type {WeakMap<Package, Map<string, Promise<Uint8Array>>>} */
const kept = new WeakMap();

/** @param {Package} pack @param {string} path @param {AbortSignal} signal */
export async function fileOf(pack, path, signal) {
  const files = kept.get(pack) ?? new Map();
  kept.set(pack, files);
  if (!files.has(path)) files.set(path, await pack.read(path, { signal }));
  return /** @type {Uint8Array} */ (files.get(path));
}

/** The texels of a small texture. @param {Package} pack @param {import("../core/types.js").Texture} texture @param {AbortSignal} signal */
export async function texelsOf(pack, texture, signal) {
  const bytes = await fileOf(pack, texture.file, signal);
  const [{ offset, stored, size, packed }] = readHead(bytes, bytes.length, [texture]);
  const texels = bytes.slice(offset, offset + stored);
  return packed ? (await import("./zstd.js")).unpacked(texels, size, texture.file, VolpkgError) : texels;
}
