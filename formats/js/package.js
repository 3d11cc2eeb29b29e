/** A package that is open: its manifest, and its files, each checked for size and digest. */
import { VolpkgError } from "./error.js";
import { MAX_MANIFEST_BYTES, decodeManifest } from "./manifest.js";
import { Sha256 } from "./sha256.js";
import { openSource } from "./source.js";

/** @typedef {import("./source.js").Source} Source */
/** @typedef {import("./types.js").Manifest} Manifest */
/** @typedef {{loaded: number, total: number, file: string}} Progress bytes of the file that is read */
/** @typedef {{name: string, levels: number[], together: boolean}} Drawn a picture: a transfer function, or several channels together */

/** What can be drawn, and the files behind it. Get one from `openPackage`. */
export class Package {
  #source;
  #onProgress;
  #closed = new AbortController();

  /** @param {Source} source @param {Manifest} manifest @param {{onProgress?: (at: Progress) => void, digests?: boolean}} options */
  constructor(source, manifest, { onProgress, digests = true }) {
    this.#source = source;
    this.#onProgress = onProgress;
    /** The manifest. */
    this.manifest = manifest;
    /** What messages call it. */
    this.name = source.name;
    /** Why bytes of files are not compared with their digests; null if they are. @type {string | null} */
    this.unverified = digests ? null : "the page asked for no digests";
    /** Levels, the finest first, of the first channel; all channels have the same grids. */
    this.levels = manifest.channels[0]?.levels ?? [];
    /** Transfer functions of all channels, those of the first channel first. */
    this.transferFunctions = manifest.channels.flatMap((each) => each.transfer_functions);
    const names = [...new Set(manifest.programs.map((each) => each.transfer))];
    /** Pictures that can be drawn, the default one first, with their levels, the finest first. @type {Drawn[]} */
    this.programs = names.map((name) => {
      const levels = manifest.programs.flatMap((each) => (each.transfer === name ? each.levels : []));
      return { name, levels: [...new Set(levels)].sort((a, b) => a - b), together: name === manifest.together?.name };
    });
  }

  /**
   * Size of a file as the manifest says it.
   * @param {string} path
   */
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
      // Not before the first bytes are there: a size that a manifest claims may be far beyond what comes.
      all ??= new Uint8Array(this.size(path));
      all.set(piece, at);
      at += piece.length;
    }
    return all ?? new Uint8Array(0);
  }

  /**
   * A file in pieces, each valid until the next is asked for. Throws behind the last one if the digest is not that of the manifest: use nothing before.
   * @param {string} path
   * @param {{signal?: AbortSignal}} [options]
   * @returns {AsyncGenerator<Uint8Array, void>}
   */
  async *stream(path, { signal } = {}) {
    const { size_bytes: expected, sha256 } = this.#record(path);
    const wrong = (/** @type {unknown} */ size) => new VolpkgError("VP4008", { path: this.name, file: path, size, expected });
    const both = signal ? AbortSignal.any([signal, this.#closed.signal]) : this.#closed.signal;
    both.throwIfAborted();
    const hash = this.unverified === null ? new Sha256() : null;
    let at = 0;
    for await (const piece of this.#source.stream(path, both)) {
      both.throwIfAborted();
      const size = this.#source.size(path) ?? expected;
      if (size !== expected) throw wrong(size);
      at += piece.length;
      if (at > expected) throw wrong(`more than ${at - piece.length}`);
      hash?.update(piece);
      yield piece;
      this.#onProgress?.({ loaded: at, total: expected, file: path });
    }
    if (at !== expected) throw wrong(at);
    if (hash && hash.digest() !== sha256) throw new VolpkgError("VP4009", { path: this.name, file: path });
  }

  /**
   * A text file.
   * @param {string} path @param {{signal?: AbortSignal}} [options]
   */
  async text(path, options) {
    const bytes = await this.read(path, options);
    try {
      return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
    } catch {
      throw new VolpkgError("VP4011", { path: this.name, problem: `${path} is not UTF-8` });
    }
  }

  /** Ends whatever is being read. Nothing can be read afterwards. */
  close() {
    this.#closed.abort();
  }

  /** @param {string} path */
  #record(path) {
    const record = this.manifest.files.find((each) => each.path === path);
    if (!record) throw new VolpkgError("VP4014", { path: this.name, file: path });
    return record;
  }
}

/**
 * Opens a package and checks its manifest. Files are read, and checked, when they are needed.
 * @param {string | URL | Blob | ArrayBuffer} from address of the folder, or a .volpkg.zip: its address, File, Blob or bytes
 * @param {{signal?: AbortSignal, onProgress?: (at: Progress) => void, digests?: boolean, idleSeconds?: number}} [options]
 *   `digests` false trusts the bytes; `idleSeconds` is how long a server may be silent, 20 if absent
 * @returns {Promise<Package>}
 */
export async function openPackage(from, options = {}) {
  const source = await openSource(from, options);
  /** @type {Uint8Array[]} */
  const pieces = [];
  let size = 0;
  for await (const piece of source.stream("manifest.json", options.signal)) {
    pieces.push(piece.slice());
    size += piece.length;
    if (size > MAX_MANIFEST_BYTES) {
      throw new VolpkgError("VP4002", { path: source.name, problem: `manifest.json is larger than ${MAX_MANIFEST_BYTES} bytes` });
    }
  }
  const bytes = new Uint8Array(await new Blob(/** @type {BlobPart[]} */ (pieces)).arrayBuffer());
  return new Package(source, await decodeManifest(bytes, source.name), options);
}
