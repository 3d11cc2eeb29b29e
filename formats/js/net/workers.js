/**
 * Digests and unpacking beside the page: in a worker each, so that no picture waits for them. A page that may start no
 * worker (an inline page, a policy, a bundle without worker.js) does the same itself.
 */
import { VolpkgError } from "../core/error.js";
import { Sha256 } from "./sha256.js";

/** Smaller files are digested here: it takes less than the way to the worker, and nothing waits for it to start. */
const SMALL = 1 << 18;
/** Bytes that may wait to be hashed, and to be unpacked: unpacked bytes also wait for the GPU. */
const [MOST_WAITING, MOST_UNPACKING] = [1 << 23, 1 << 20];

/** @typedef {{take: (message: any) => void, fail: (error: unknown) => void}} Asked */
/**
 * Unpacks frames, here or in the worker.
 * @typedef {object} Unpacker
 * @property {(piece: Uint8Array) => void} take
 * @property {() => Promise<void> | void} finish throws where there is not all of it
 * @property {() => Promise<void>} [settle] waits until not too much is waiting
 * @property {() => void} [end]
 */

/** Functions that start the workers; bundlers know this form. @type {Record<string, () => Worker>} */
const WORKERS = {
  digest: () => new Worker(new URL("./worker.js", import.meta.url), { type: "module" }),
  frames: () => new Worker(new URL("./unpack_worker.js", import.meta.url), { type: "module" }),
};
/** @type {Map<string, Promise<Worker | null>>} */
const started = new Map();
/** @type {Map<number, Asked>} */
const asked = new Map();
let last = 0;

/** Starts a worker, once; null if the page may have none. @param {"digest" | "frames"} [kind] */
export function begin(kind = "digest") {
  const worker = started.get(kind) ?? start(WORKERS[kind]);
  started.set(kind, worker);
  return worker;
}

/** @param {() => Worker} make @returns {Promise<Worker | null>} */
function start(make) {
  return new Promise((resolve) => {
    try {
      const worker = make();
      worker.onmessage = ({ data }) => (data.ready ? resolve(worker) : asked.get(data.id)?.take(data));
      worker.onerror = () => {
        resolve(null);
        for (const each of asked.values()) each.fail(new Error("the worker of this page has ended"));
      };
    } catch {
      resolve(null);
    }
  });
}

/** Work of one file that the worker does. */
class Job {
  #id = ++last;
  #waiting = 0;
  /** @type {() => void} */
  #wake = () => {};
  #worker;

  /**
   * @param {Worker} worker @param {object} what
   * @param {(texels: Uint8Array) => void} [emit] receives unpacked bytes
   */
  constructor(worker, what, emit) {
    this.#worker = worker;
    /** Resolves with the result. @type {Promise<string>} */
    this.done = new Promise((resolve, reject) => {
      asked.set(this.#id, {
        take: ({ error, took = 0, texels, result }) => {
          if (texels) emit?.(texels);
          if (result !== undefined) resolve(result);
          if (error) this.#fail(reject, error);
          this.#waiting -= took;
          this.#wake();
        },
        fail: (error) => this.#fail(reject, { words: String(error) }),
      });
    });
    this.done.catch(() => {});
    worker.postMessage({ id: this.#id, what });
  }

  /** Sends a copy of bytes. @param {Uint8Array} piece */
  send(piece) {
    const copy = piece.slice();
    this.#waiting += copy.length;
    this.#worker.postMessage({ id: this.#id, piece: copy }, [copy.buffer]);
  }

  /** Waits until at most so many bytes are left to do. @param {number} most */
  async until(most) {
    while (this.#waiting > most)
      await Promise.race([this.done, new Promise((resolve) => (this.#wake = () => resolve(null)))]);
  }

  /** Ends the input; returns the result. */
  finish() {
    this.#worker.postMessage({ id: this.#id, finish: true });
    return this.done;
  }

  end() {
    if (asked.delete(this.#id)) this.#worker.postMessage({ id: this.#id, end: true });
  }

  /**
   * @param {(error: unknown) => void} reject
   * @param {{words: string, code?: string, fields?: Record<string, unknown>}} why
   */
  #fail(reject, { words, code, fields }) {
    reject(code ? new VolpkgError(code, fields) : new Error(words));
  }
}

/** SHA-256 of a file that comes in pieces. */
class Digest {
  #size;
  /** @type {Sha256 | null} */
  #here = null;
  /** @type {Job | null} */
  #job = null;

  /** @param {number} size */
  constructor(size) {
    this.#size = size;
  }

  /** @param {Uint8Array} piece */
  async update(piece) {
    if (!this.#here && !this.#job) {
      const worker = this.#size > SMALL ? await begin() : null;
      if (worker) this.#job = new Job(worker, {});
      else this.#here = new Sha256();
    }
    this.#here?.update(piece);
    this.#job?.send(piece);
    await this.#job?.until(MOST_WAITING);
  }

  /** @returns {Promise<string>} */
  async digest() {
    return this.#job ? this.#job.finish() : (this.#here ?? new Sha256()).digest();
  }

  end() {
    this.#job?.end();
  }
}

/** Returns a hasher for a file of a size. @param {number} size */
export const digestOf = (size) => new Digest(size);

/**
 * Returns an unpacker for Zstandard frames.
 * @param {number} size of their content, all together
 * @param {(texels: Uint8Array) => void} emit receives the content of each frame
 * @param {string} file for messages
 * @returns {Promise<Unpacker>}
 */
export async function framesOf(size, emit, file) {
  const worker = size > SMALL ? await begin("frames") : null;
  if (!worker) return new (await import("./zstd.js")).Frames(size, emit, file, VolpkgError);
  const job = new Job(worker, { size, file }, emit);
  return {
    /** @param {Uint8Array} piece */
    take(piece) {
      if (piece.length) job.send(piece);
    },
    /** Waits until most of the input is unpacked. */
    settle: () => job.until(MOST_UNPACKING),
    /** Waits until all of it is. */
    async finish() {
      await job.finish();
    },
    end: () => job.end(),
  };
}
