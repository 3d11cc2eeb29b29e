/** The manifest of a package. Its checks load at the same time. */

/** @typedef {import("./types.js").Manifest} Manifest */

export const MAX_MANIFEST_BYTES = 4 << 20;
const strict = import("./strict.js");
strict.catch(() => {});

/**
 * @param {Uint8Array} bytes at most MAX_MANIFEST_BYTES
 * @param {string} name of the package, for messages
 * @returns {Promise<Manifest>}
 */
export async function decodeManifest(bytes, name) {
  return (await strict).decodeManifest(bytes, name);
}
