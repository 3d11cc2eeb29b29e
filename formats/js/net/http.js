/** Requests to a server, and their bodies in pieces. A server that is silent for too long is an error. */
import { check } from "../core/abort.js";
import { VolpkgError } from "../core/error.js";

/** @typedef {import("../core/package.js").OpenOptions} OpenOptions */

const PIECE = 1 << 18;
const IDLE_SECONDS = 20;

/**
 * @param {URL} url @param {Record<string, string>} range @param {OpenOptions} options @param {AbortSignal} [signal]
 * @param {RequestCache} [cache] how the browser's cache is used
 */
export async function request(
  url,
  range,
  { headers: given, fetch: ask = fetch, idleSeconds = IDLE_SECONDS },
  signal,
  cache,
) {
  check(signal);
  const headers = new Headers(typeof given === "function" ? await given() : given);
  for (const [name, value] of Object.entries(range)) headers.set(name, value);
  try {
    return await soon(ask(url.href, { headers, signal, cache }), url, idleSeconds);
  } catch (error) {
    if (signal?.aborted || error instanceof VolpkgError) throw error;
    throw new VolpkgError("VP7015", { url: url.href, answer: `nothing (${error})` });
  }
}

/**
 * The bytes of an answer. Each piece is valid until the next is asked for: where the browser can, all share one buffer,
 * so that no garbage as large as the file piles up.
 * @param {Response} response @param {URL} url @param {OpenOptions} options
 */
export async function* body(response, url, { idleSeconds: seconds = IDLE_SECONDS }) {
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
