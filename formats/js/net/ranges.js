/** Reads parts of a file on a server by HTTP ranges. */
import { VolpkgError } from "../core/error.js";
import { body, request } from "./http.js";
import { local } from "./zip.js";

/** @typedef {import("./source.js").Bytes} Bytes */
/** @typedef {import("../core/package.js").OpenOptions} OpenOptions */
/** Bytes of the file from `at` on. @typedef {{at: number, bytes: Uint8Array}} Kept */
/** @typedef {() => AsyncGenerator<Uint8Array, void>} Pieces */
/**
 * A part that is wanted.
 * @typedef {{start: number, end: number, signal?: AbortSignal, give: (pieces: Pieces) => void}} Asked
 */

/**
 * Size of the first request, from the start: the manifest, and the coarsest level of most packages, which a writer puts
 * behind it.
 */
const HEAD = 1 << 17;
/** Size of another request, from the end at the same time: the directory. */
const TAIL = 1 << 16;
/** Parts this close are merged into one request: the gap costs less than another request. */
const GAP = 1 << 14;
/** Parts that are joined are kept until they are read; larger ones are read as they come. */
const MOST_JOINED = 1 << 20;

/**
 * A file on a server, by ranges. A server that does not know ranges sends the whole file, which is then kept.
 * @param {URL} url
 * @param {OpenOptions} options
 * @param {AbortSignal} [signal]
 * @returns {Promise<Bytes>}
 */
export async function remote(url, options, signal) {
  const tail = end(url, options, signal);
  const first = await request(url, { range: `bytes=0-${HEAD - 1}` }, options, signal);
  if (first.status === 404) throw new VolpkgError("VP4001", { path: url.href });
  if (first.status !== 200 && first.status !== 206) throw refused(url, `${first.status} when asked for a range`);
  const bytes = await gather(body(first, url, options));
  if (first.status === 200) return local(bytes.length, (start, end) => bytes.subarray(start, end));
  const size = Number(/\/(\d+)$/.exec(first.headers.get("content-range") ?? "")?.[1] ?? NaN);
  if (!Number.isSafeInteger(size)) throw refused(url, "206 without a size when asked for a range");
  if (bytes.length !== Math.min(HEAD, size)) throw refused(url, `${bytes.length} bytes when asked for ${HEAD}`);
  const last = await tail;
  const kept = [{ at: 0, bytes }, ...(last && last.at + last.bytes.length === size ? [last] : [])];
  return new Ranges(url, options, size, kept);
}

/**
 * The end of the file, asked for before its size is known; null if the server does not know such ranges. Servers of
 * other origins would be asked whether they allow it, which takes as long as it saves.
 * @param {URL} url @param {OpenOptions} options @param {AbortSignal} [signal] @returns {Promise<Kept | null>}
 */
async function end(url, options, signal) {
  if (url.origin !== globalThis.location?.origin) return null;
  try {
    // Chrome sends requests for parts of one address in turn, unless they pass its cache by.
    const response = await request(url, { range: `bytes=-${TAIL}` }, options, signal, "no-store");
    const at = Number(/^bytes (\d+)-/.exec(response.headers.get("content-range") ?? "")?.[1] ?? NaN);
    if (response.status === 206 && Number.isSafeInteger(at))
      return { at, bytes: await gather(body(response, url, options)) };
    await response.body?.cancel();
  } catch {
    // It is asked for again, with its size.
  }
  return null;
}

/** @param {AsyncIterable<Uint8Array>} pieces */
async function gather(pieces) {
  const all = [];
  for await (const piece of pieces) all.push(piece.slice());
  return new Uint8Array(await new Blob(/** @type {BlobPart[]} */ (all)).arrayBuffer());
}

/** @param {URL} url @param {string} answer */
const refused = (url, answer) => new VolpkgError("VP7015", { url: url.href, answer });

/** Gives a part that is still to come. @param {Asked["give"]} give */
function promised(give) {
  /** @type {(bytes: Uint8Array) => void} */
  let done = () => {};
  /** @type {(error: unknown) => void} */
  let fail = () => {};
  const whole = new Promise((/** @type {(bytes: Uint8Array) => void} */ resolve, reject) => {
    [done, fail] = [resolve, reject];
  });
  whole.catch(() => {});
  give(async function* () {
    yield await whole;
  });
  return { done, fail };
}

/** Parts of a file. Those that are asked for at the same time and lie beside each other come with one request. */
class Ranges {
  #url;
  #options;
  #kept;
  /** @type {Asked[]} */
  #asked = [];

  /** @param {URL} url @param {OpenOptions} options @param {number} size @param {Kept[]} kept */
  constructor(url, options, size, kept) {
    this.#url = url;
    this.#options = options;
    this.size = size;
    this.#kept = kept;
  }

  /** @param {number} start @param {number} end @param {AbortSignal} [signal] */
  async *part(start, end, signal) {
    if (end <= start) return;
    const kept = this.#kept.find(({ at, bytes }) => at <= start && end <= at + bytes.length);
    if (kept) {
      yield kept.bytes.slice(start - kept.at, end - kept.at);
      return;
    }
    const pieces = await new Promise((/** @type {(pieces: Pieces) => void} */ give) => {
      this.#asked.push({ start, end, signal, give });
      // Others may be asked for in this turn.
      if (this.#asked.length === 1) setTimeout(() => this.#send());
    });
    yield* pieces();
  }

  /** Sends the queued reads, with few requests. */
  #send() {
    const asked = this.#asked.sort((a, b) => a.start - b.start);
    this.#asked = [];
    /** @type {Asked[][]} */
    const groups = [];
    for (const each of asked) {
      const group = groups[groups.length - 1];
      const before = group?.[group.length - 1];
      const near = before && each.start >= before.end && each.start - before.end <= GAP;
      if (near && each.end - group[0].start <= MOST_JOINED) group.push(each);
      else groups.push([each]);
    }
    for (const group of groups) this.#join(group);
  }

  /**
   * Reads parts that lie beside each other with one request; each is given as soon as it is whole.
   * @param {Asked[]} group parts in order
   */
  async #join(group) {
    const [{ start }] = group;
    const { end } = group[group.length - 1];
    if (group.length === 1) return group[0].give(() => this.#fetched(start, end, group[0].signal));
    const stop = new AbortController();
    const ended = () => group.every((each) => each.signal?.aborted) && stop.abort();
    const parts = group.map(({ start, end, signal, give }) => {
      signal?.addEventListener("abort", ended);
      return { start, end, bytes: new Uint8Array(end - start), ...promised(give) };
    });
    let at = start;
    try {
      for await (const piece of this.#fetched(start, end, stop.signal)) {
        const to = at + piece.length;
        if (to > end) break;
        for (const part of parts) {
          const [from, last] = [Math.max(at, part.start), Math.min(to, part.end)];
          if (from < last) part.bytes.set(piece.subarray(from - at, last - at), from - part.start);
          if (at < part.end && part.end <= to) part.done(part.bytes);
        }
        at = to;
      }
      throw refused(this.#url, `another number of bytes than it was asked for, ${end - start}`);
    } catch (error) {
      // Nothing happens to parts that are whole.
      for (const part of parts) part.fail(error);
    }
  }

  /** @param {number} start @param {number} end @param {AbortSignal} [signal] */
  async *#fetched(start, end, signal) {
    const response = await request(this.#url, { range: `bytes=${start}-${end - 1}` }, this.#options, signal);
    const range = response.headers.get("content-range");
    if (response.status !== 206 || range !== `bytes ${start}-${end - 1}/${this.size}`) {
      await response.body?.cancel();
      throw refused(this.#url, `${response.status} ${range} when asked for ${start}-${end - 1}`);
    }
    yield* body(response, this.#url, this.#options);
  }
}
