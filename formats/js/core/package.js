/** A package that is open: its manifest, and its files, each checked for size and digest. */
import { check, either } from "./abort.js";
import { VolpkgError } from "./error.js";
import { MAX_MANIFEST_BYTES, decodeManifest } from "./manifest.js";
import { openSource } from "../net/source.js";

/** @typedef {import("../net/source.js").Source} Source */
/** @typedef {import("./types.js").Manifest} Manifest */
/**
 * Bytes of all requested files, including levels that are still to come.
 * @typedef {{loaded: number, total: number, file: string}} Progress
 */
/**
 * A picture: one transfer function, or several together (channels or segments).
 * @typedef {{name: string, levels: number[], together: boolean}} Drawn
 */
/** @typedef {AsyncIterator<Uint8Array, void>} Pieces */

/** Files that will be needed are requested when the others lack at most this: a tenth of a second at 10 Mbit/s. */
const AHEAD = 1 << 17;
/** Largest request for several files together, in bytes. */
const JOINED = 1 << 20;
/** Open requests at a time: the limit of browsers for a server of HTTP 1. */
const MOST_OPEN = 6;

/** The drawable content of a package, and its files. Get one from `openPackage`. */
export class Package {
  #source;
  #onProgress;
  #closed;
  #records;
  /** Texts of shaders. @type {Map<string, Promise<string>>} */
  #texts = new Map();
  /** Bytes of each file that was asked for that have come. @type {Map<string, number>} */
  #come = new Map();
  /** Files whose bytes come now. @type {Set<string>} */
  #open = new Set();
  /** Files that will be asked for. @type {Map<string, AbortSignal>} */
  #expected = new Map();
  /**
   * Files that were asked for before anybody reads them.
   * @type {Map<string, {pieces: Pieces, first: Promise<IteratorResult<Uint8Array, void>>}>}
   */
  #early = new Map();

  /** @param {Source} source @param {Manifest} manifest @param {OpenOptions} options */
  constructor(source, manifest, { onProgress, digests = true, signal }) {
    this.#source = source;
    this.#onProgress = onProgress;
    this.#closed = either(signal);
    this.#records = new Map(manifest.files.map((file) => [file.path, file]));
    /** The manifest. */
    this.manifest = manifest;
    /** Name in messages. */
    this.name = source.name;
    /** Why bytes of files are not compared with their digests; null if they are. @type {string | null} */
    this.unverified = digests ? null : "the page asked for no digests";
    /** Levels, the finest first, of the first channel. */
    this.levels = manifest.channels[0]?.levels ?? [];
    /** Transfer functions of all channels, beginning with the first channel. */
    this.transferFunctions = manifest.channels.flatMap((channel) => channel.transfer_functions);
    /** Pictures that can be drawn, the default one first, with their levels, the finest first. @type {Drawn[]} */
    this.programs = manifest.pictures.map(({ name, mixing = "one", drawings }) => ({
      name,
      levels: drawings.filter(({ frame }) => !frame).map(({ level }) => level),
      together: mixing !== "one",
    }));
  }

  /** Aborted when the package is closed. */
  get signal() {
    return this.#closed.signal;
  }

  /** Size of a file as the manifest says it. @param {string} path */
  size(path) {
    return this.#record(path).size_bytes;
  }

  /**
   * A file, whole.
   * @param {string} path
   * @param {{signal?: AbortSignal}} [options]
   * @returns {Promise<Uint8Array<ArrayBuffer>>}
   */
  async read(path, options) {
    /** @type {Uint8Array<ArrayBuffer> | undefined} */
    let all;
    let at = 0;
    for await (const piece of this.stream(path, options)) {
      // Not before the first bytes are there: a manifest may claim far too large a size.
      all ??= new Uint8Array(this.size(path));
      all.set(piece, at);
      at += piece.length;
    }
    return all ?? new Uint8Array(0);
  }

  /**
   * A file in pieces, each valid until the next one is requested. Throws after the last piece if the digest differs
   * from the manifest: do not use the pieces before the end.
   * @param {string} path
   * @param {{signal?: AbortSignal}} [options]
   * @returns {AsyncGenerator<Uint8Array, void>}
   */
  async *stream(path, { signal } = {}) {
    const { size_bytes: expected, sha256 } = this.#record(path);
    const wrong = (/** @type {unknown} */ size) =>
      new VolpkgError("VP4008", { path: this.name, file: path, size, expected });
    const both = either(signal, this.#closed.signal);
    const hash = this.unverified === null ? (await import("../net/workers.js")).digestOf(expected) : null;
    let at = 0;
    try {
      check(both.signal);
      for await (const piece of this.#pieces(path, both.signal)) {
        check(both.signal);
        const size = this.#source.size(path) ?? expected;
        if (size !== expected) throw wrong(size);
        at += piece.length;
        if (at > expected) throw wrong(`more than ${at - piece.length}`);
        await hash?.update(piece);
        this.#came(path, at);
        yield piece;
      }
      if (at !== expected) throw wrong(at);
      if (hash && (await hash.digest()) !== sha256) throw new VolpkgError("VP4009", { path: this.name, file: path });
    } finally {
      hash?.end();
      both.abort();
      this.#open.delete(path);
      this.#ahead();
    }
  }

  /** A text file. @param {string} path @param {{signal?: AbortSignal}} [options] */
  text(path, options) {
    const found = this.#texts.get(path) ?? this.#text(path, options);
    this.#texts.set(path, found);
    found.catch(() => this.#texts.delete(path));
    return found;
  }

  /**
   * Announces files, in the order in which they will be read: progress counts them, and they are asked for as soon as
   * those before have almost come.
   * @param {string[]} paths @param {AbortSignal} signal until when they are wanted
   */
  expect(paths, signal) {
    for (const path of paths) {
      if (this.#texts.has(path) || this.#come.get(path) === this.size(path)) continue;
      if (!this.#come.has(path)) this.#come.set(path, 0);
      if (!this.#open.has(path)) this.#expected.set(path, signal);
    }
    this.#ahead();
  }

  /** Ends whatever is being read. Nothing can be read afterwards. */
  close() {
    this.#closed.abort();
  }

  /** @param {string} path @param {{signal?: AbortSignal}} [options] */
  async #text(path, options) {
    const bytes = await this.read(path, options);
    try {
      return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
    } catch {
      throw new VolpkgError("VP4011", { path: this.name, problem: `${path} is not UTF-8` });
    }
  }

  /** @param {string} path @param {number} at */
  #came(path, at) {
    this.#come.set(path, at);
    this.#ahead();
    const sum = (/** @type {Iterable<number>} */ all) => [...all].reduce((one, other) => one + other, 0);
    const total = sum([...this.#come.keys()].map((value) => this.size(value)));
    this.#onProgress?.({ loaded: sum(this.#come.values()), total, file: path });
  }

  /**
   * For modules of this reader: a part of a file, or all of it from a server that does not know ranges.
   * @param {string} path @param {Record<string, string>} range @param {AbortSignal} signal
   */
  part(path, range, signal) {
    return this.#source.stream(path, signal, range);
  }

  /** The pieces of a file, which may have been asked for already. @param {string} path @param {AbortSignal} signal */
  async *#pieces(path, signal) {
    this.#expected.delete(path);
    this.#open.add(path);
    if (!this.#come.has(path)) this.#come.set(path, 0);
    const early = this.#early.get(path);
    this.#early.delete(path);
    if (!early) return yield* this.#source.stream(path, signal);
    try {
      for (let { done, value } = await early.first; !done && value; { done, value } = await early.pieces.next())
        yield value;
    } finally {
      early.pieces.return?.();
    }
  }

  /** Asks for files that are expected, if little else is to come. */
  #ahead() {
    const { joins } = this.#source;
    let left = [...this.#open].reduce((sum, path) => sum + this.size(path) - (this.#come.get(path) ?? 0), 0);
    if (left > AHEAD) return;
    for (const [path, signal] of this.#expected) {
      if (joins ? left > JOINED : left > AHEAD || this.#open.size >= MOST_OPEN) return;
      this.#expected.delete(path);
      if (signal.aborted) continue;
      left += this.size(path);
      this.#open.add(path);
      const { signal: both } = either(signal, this.#closed.signal);
      const pieces = this.#source.stream(path, both)[Symbol.asyncIterator]();
      const first = pieces.next();
      this.#early.set(path, { pieces, first });
      first.catch(() => {});
      both.addEventListener("abort", () => {
        if (this.#early.delete(path)) this.#open.delete(path);
      });
    }
  }

  /** @param {string} path */
  #record(path) {
    const record = this.#records.get(path);
    if (!record) throw new VolpkgError("VP4014", { path: this.name, file: path });
    return record;
  }
}

/**
 * @typedef {object} OpenOptions
 * @property {AbortSignal} [signal] ends everything that is read, now and later
 * @property {(at: Progress) => void} [onProgress]
 * @property {boolean} [digests] false trusts the bytes
 * @property {number} [idleSeconds] how long a server may be silent, 20 if absent
 * @property {HeadersInit | (() => HeadersInit | Promise<HeadersInit>)} [headers] sent with each request, or a
 *   function that returns them
 * @property {typeof fetch} [fetch] used in place of the browser's
 */

/**
 * Opens a package and checks its manifest. Files are read, and checked, when they are needed.
 * @param {string | URL | Blob | ArrayBuffer | ArrayBufferView} from address of the folder, or a .volpkg.zip: its
 *   address, a blob: address, File, Blob or bytes
 * @param {OpenOptions} [options]
 * @returns {Promise<Package>}
 */
export async function openPackage(from, options = {}) {
  // Comes while the manifest does.
  const beside = options.digests === false ? null : import("../net/workers.js");
  beside?.then(({ begin }) => begin()).catch(() => {});
  // Its import is loaded at the same time and not after it.
  if (beside) import("../net/sha256.js").catch(() => {});
  const source = await openSource(from, options);
  /** @type {Uint8Array[]} */
  const pieces = [];
  let size = 0;
  for await (const piece of source.stream("manifest.json", options.signal)) {
    pieces.push(piece.slice());
    size += piece.length;
    if (size > MAX_MANIFEST_BYTES) {
      const problem = `manifest.json is larger than ${MAX_MANIFEST_BYTES} bytes`;
      throw new VolpkgError("VP4002", { path: source.name, problem });
    }
  }
  const bytes = new Uint8Array(await new Blob(/** @type {BlobPart[]} */ (pieces)).arrayBuffer());
  return new Package(source, await decodeManifest(bytes, source.name), options);
}
