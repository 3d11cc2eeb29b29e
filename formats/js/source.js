/** Where the bytes of a package come from: a folder over HTTP, or one file that is a zip. */
import { VolpkgError } from "./error.js";

/**
 * Bytes of known size, of which any part can be had.
 * @typedef {object} Bytes
 * @property {number} size
 * @property {(start: number, end: number, signal?: AbortSignal) => AsyncIterable<Uint8Array>} part
 */

/**
 * The files of a package.
 * @typedef {object} Source
 * @property {string} name what messages call the package
 * @property {(path: string, signal?: AbortSignal) => AsyncIterable<Uint8Array>} stream a file, piece by piece; each is
 *   valid until the next is asked for
 * @property {(path: string) => number | undefined} size of a file, where it is known before it is read
 */

const PIECE = 1 << 18;

/**
 * @param {string | URL | Blob | ArrayBuffer} from
 * @param {{signal?: AbortSignal, idleSeconds?: number}} options
 * @returns {Promise<Source>}
 */
export async function openSource(from, { signal, idleSeconds = 20 }) {
  if (typeof from === "string" || from instanceof URL) {
    const url = new URL(from, globalThis.document?.baseURI ?? globalThis.location?.href);
    if (!/\.zip$/i.test(url.pathname)) return folder(url, idleSeconds);
    const [{ openZip }, { remote }] = await Promise.all([import("./zip.js"), import("./ranges.js")]);
    return openZip(url.pathname.split("/").pop() || url.href, await remote(url, idleSeconds, signal), signal);
  }
  const { openZip, local } = await import("./zip.js");
  const name = /** @type {File} */ (from).name || "package";
  if (from instanceof Blob) return openZip(name, local(from.size, (start, end) => from.slice(start, end).arrayBuffer()), signal);
  if (from instanceof ArrayBuffer) return openZip(name, local(from.byteLength, (start, end) => new Uint8Array(from, start, end - start)), signal);
  throw new VolpkgError("VP7017", { what: Object.prototype.toString.call(from) });
}

/**
 * @param {URL} url of the folder, or of its manifest; what it asks for stays with each request
 * @param {number} idleSeconds
 * @returns {Source}
 */
function folder(url, idleSeconds) {
  const base = new URL(url);
  base.pathname = base.pathname.replace(/manifest\.json$/, "").replace(/\/?$/, "/");
  const name = decodeURIComponent(base.pathname.split("/").at(-2) || base.host);
  const sizes = /** @type {Map<string, number>} */ (new Map());
  return {
    name,
    size: (path) => sizes.get(path),
    async *stream(path, signal) {
      const at = new URL(base);
      at.pathname += path;
      const response = await request(at, {}, idleSeconds, signal);
      if (response.status === 404 && path === "manifest.json") throw new VolpkgError("VP4001", { path: at.href });
      if (!response.ok) throw new VolpkgError("VP4007", { path: name, file: path, error: `the server answers ${response.status}` });
      const length = response.headers.get("content-length");
      if (length && !response.headers.get("content-encoding")) sizes.set(path, Number(length));
      yield* body(response, at, idleSeconds);
    },
  };
}

/** @param {URL} url @param {Record<string, string>} headers @param {number} seconds @param {AbortSignal} [signal] */
export async function request(url, headers, seconds, signal) {
  signal?.throwIfAborted();
  try {
    return await soon(fetch(url, { headers, signal }), url, seconds);
  } catch (error) {
    if (signal?.aborted || error instanceof VolpkgError) throw error;
    throw new VolpkgError("VP7015", { url: url.href, answer: `nothing (${error})` });
  }
}

/**
 * The bytes of an answer. Each piece is valid until the next is asked for: where the browser can, all share one buffer, so
 * that no garbage as large as the file piles up.
 * @param {Response} response @param {URL} url @param {number} seconds
 */
export async function* body(response, url, seconds) {
  const stream = /** @type {ReadableStream<Uint8Array<ArrayBuffer>>} */ (response.body);
  /** @type {() => Promise<{done: boolean, value?: Uint8Array<ArrayBuffer>}>} */
  let read;
  /** @type {ReadableStreamBYOBReader | ReadableStreamDefaultReader} */
  let reader;
  try {
    const byob = stream.getReader({ mode: "byob" });
    let buffer = new ArrayBuffer(PIECE);
    reader = byob;
    read = async () => {
      const found = await byob.read(new Uint8Array(buffer));
      if (found.value) buffer = found.value.buffer;
      return found;
    };
  } catch {
    const plain = stream.getReader();
    reader = plain;
    read = () => plain.read();
  }
  try {
    for (;;) {
      const { done, value } = await soon(read(), url, seconds);
      if (done || !value) return;
      yield value;
    }
  } catch (error) {
    if (error instanceof VolpkgError || /** @type {Error} */ (error).name === "AbortError") throw error;
    throw new VolpkgError("VP7015", { url: url.href, answer: `with less than it promised (${error})` });
  } finally {
    reader.cancel().catch(() => {});
  }
}

/**
 * A promise that must not take long.
 * @template T
 * @param {Promise<T>} promise
 * @param {URL} url
 * @param {number} seconds
 * @returns {Promise<T>}
 */
function soon(promise, url, seconds) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new VolpkgError("VP7016", { url: url.href, seconds })), seconds * 1000);
    promise.then(resolve, reject).finally(() => clearTimeout(timer));
  });
}
