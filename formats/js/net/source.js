/** Where the bytes of a package come from: a folder over HTTP, or one file that is a zip. */
import { VolpkgError } from "../core/error.js";
import { body, request } from "./http.js";

/**
 * Bytes of known size; any part can be read.
 * @typedef {object} Bytes
 * @property {number} size
 * @property {(start: number, end: number, signal?: AbortSignal) => AsyncIterable<Uint8Array>} part
 */

/**
 * The files of a package.
 * @typedef {object} Source
 * @property {string} name name of the package in messages
 * @property {(path: string, signal?: AbortSignal, range?: Record<string, string>) => AsyncIterable<Uint8Array>} stream a
 *   file, piece by piece; each is valid until the next is asked for; with the header of a range a server may give a part
 * @property {(path: string) => number | undefined} size of a file, where it is known before it is read
 * @property {boolean} [joins] whether files that are asked for together may come with one request
 */

/** @typedef {import("../core/package.js").OpenOptions} OpenOptions */

/**
 * @param {string | URL | Blob | ArrayBuffer | ArrayBufferView} from
 * @param {OpenOptions} options
 * @returns {Promise<Source>}
 */
export async function openSource(from, options) {
  const { signal } = options;
  if (typeof from === "string" || from instanceof URL) {
    const url = new URL(from, globalThis.document?.baseURI ?? globalThis.location?.href);
    if (url.protocol === "blob:") return openSource(await (await request(url, {}, options, signal)).blob(), options);
    if (!/\.zip$/i.test(url.pathname)) return folder(url, options);
    const [{ openZip }, { remote }] = await Promise.all([import("./zip.js"), import("./ranges.js")]);
    return openZip(url.pathname.split("/").pop() || url.href, await remote(url, options, signal), signal);
  }
  const { openZip, local } = await import("./zip.js");
  const name = /** @type {File | undefined} */ (from)?.name || "package";
  if (from instanceof Blob)
    return openZip(
      name,
      local(from.size, (start, end) => from.slice(start, end).arrayBuffer()),
      signal,
    );
  const [buffer, at, size] = ArrayBuffer.isView(from)
    ? [from.buffer, from.byteOffset, from.byteLength]
    : [from, 0, from?.byteLength];
  if (buffer instanceof ArrayBuffer) {
    return openZip(
      name,
      local(size, (start, end) => new Uint8Array(buffer, at + start, end - start)),
      signal,
    );
  }
  await import("../core/messages.js");
  throw new VolpkgError("VP7017", { what: from });
}

/**
 * @param {URL} url of the folder, or of its manifest; its query is sent with each request
 * @param {OpenOptions} options
 * @returns {Source}
 */
function folder(url, options) {
  const base = new URL(url);
  base.pathname = base.pathname.replace(/manifest\.json$/, "").replace(/\/?$/, "/");
  const name = decodeURIComponent(base.pathname.split("/").slice(-2)[0] || base.host);
  const sizes = /** @type {Map<string, number>} */ (new Map());
  return {
    name,
    size: (path) => sizes.get(path),
    async *stream(path, signal, range = {}) {
      const at = new URL(base);
      at.pathname += path;
      const response = await request(at, range, options, signal);
      const { ok, status } = response;
      if (!ok && path !== "manifest.json")
        throw new VolpkgError("VP4007", { path: name, file: path, error: `the server answers ${status}` });
      if (status === 404) throw new VolpkgError("VP4001", { path: at.href });
      if (!ok) throw new VolpkgError("VP7015", { url: at.href, answer: status });
      const length = response.headers.get("content-length");
      if (length && !response.headers.get("content-encoding")) sizes.set(path, Number(length));
      yield* body(response, at, options);
    },
  };
}
