/** What a server answers, in pieces, and never with silence. */
import { VolpkgError } from "./error.js";

const PIECE = 1 << 18;

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
