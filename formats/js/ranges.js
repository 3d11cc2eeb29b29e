/** A file on a server of which parts are read, by HTTP ranges. */
import { VolpkgError } from "./error.js";
import { body, request } from "./http.js";
import { local } from "./zip.js";

/** @typedef {import("./source.js").Bytes} Bytes */

/**
 * A file on a server, by ranges. A server that does not know ranges sends the whole file, which is then kept.
 * @param {URL} url
 * @param {number} idleSeconds
 * @param {AbortSignal} [signal]
 * @returns {Promise<Bytes>}
 */
export async function remote(url, idleSeconds, signal) {
  const first = await request(url, { range: "bytes=0-0" }, idleSeconds, signal);
  if (first.status === 404) throw new VolpkgError("VP4001", { path: url.href });
  if (first.status === 200) {
    const pieces = [];
    for await (const piece of body(first, url, idleSeconds)) pieces.push(piece.slice());
    const blob = new Blob(/** @type {BlobPart[]} */ (pieces));
    return local(blob.size, (start, end) => blob.slice(start, end).arrayBuffer());
  }
  await first.body?.cancel();
  const size = Number(/\/(\d+)$/.exec(first.headers.get("content-range") ?? "")?.[1] ?? NaN);
  if (first.status !== 206 || !Number.isSafeInteger(size)) {
    throw new VolpkgError("VP7015", { url: url.href, answer: `${first.status} without a size when asked for a range` });
  }
  return {
    size,
    async *part(start, end, signal) {
      if (end <= start) return;
      const response = await request(url, { range: `bytes=${start}-${end - 1}` }, idleSeconds, signal);
      const range = response.headers.get("content-range");
      if (response.status !== 206 || range !== `bytes ${start}-${end - 1}/${size}`) {
        await response.body?.cancel();
        throw new VolpkgError("VP7015", { url: url.href, answer: `${response.status} ${range} when asked for ${start}-${end - 1}` });
      }
      yield* body(response, url, idleSeconds);
    },
  };
}
