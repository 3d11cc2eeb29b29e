/** The single-file form of a package: a zip of stored files. Names and sizes come from its central directory. */
import { VolpkgError } from "./error.js";

/** @typedef {import("./source.js").Bytes} Bytes */
/** @typedef {import("./source.js").Source} Source */

const PIECE = 1 << 20;
const END = 22;
const END64 = 56;
const LOCATOR = 20;
const ENTRY = 46;
const HEADER = 30;
const TAIL = 1 << 16;
/** A directory of 30 000 files; a manifest of its largest size names about 13 000. */
const LARGEST_DIRECTORY = 8 << 20;

/**
 * Bytes that are here.
 * @param {number} size
 * @param {(start: number, end: number) => Uint8Array | Promise<ArrayBuffer>} slice
 * @returns {Bytes}
 */
export function local(size, slice) {
  return {
    size,
    async *part(start, end, signal) {
      for (let at = start; at < end; at += PIECE) {
        signal?.throwIfAborted();
        const piece = await slice(at, Math.min(at + PIECE, end));
        yield piece instanceof Uint8Array ? piece : new Uint8Array(piece);
      }
    },
  };
}

/**
 * @param {string} name
 * @param {Bytes} bytes
 * @param {AbortSignal} [signal]
 * @returns {Promise<Source>}
 */
export async function openZip(name, bytes, signal) {
  const entries = await directory(name, bytes, signal);
  return {
    name,
    size: (path) => entries.get(path)?.size,
    async *stream(path, signal) {
      const entry = entries.get(path);
      if (!entry) throw new VolpkgError("VP4007", { path: name, file: path, error: "not in the zip" });
      // The local header lies before the file; how much of it is padding it says itself. One request gets both.
      const head = new Uint8Array(HEADER);
      let filled = 0;
      let start = 0;
      let given = 0;
      let at = 0;
      for await (let piece of bytes.part(entry.at, entry.next, signal)) {
        if (filled < HEADER) {
          const taken = piece.subarray(0, HEADER - filled);
          head.set(taken, filled);
          filled += taken.length;
          if (filled < HEADER) {
            at += piece.length;
            continue;
          }
          start = fileStart(name, path, head, entry);
        }
        const from = Math.max(start - at, 0);
        at += piece.length;
        piece = piece.subarray(from, from + entry.size - given);
        given += piece.length;
        if (piece.length) yield piece;
        if (given === entry.size) return;
      }
      if (filled < HEADER) refuse(name, `${path} ends inside its header`);
    },
  };
}

/**
 * Where a file begins after its header, which must say what the directory says.
 * @param {string} name @param {string} path @param {Uint8Array} head @param {Entry} entry
 */
function fileStart(name, path, head, entry) {
  const view = new DataView(head.buffer);
  const sizes = [view.getUint32(18, true), view.getUint32(22, true)];
  const start = HEADER + view.getUint16(26, true) + view.getUint16(28, true);
  if (
    view.getUint32(0, true) !== 0x04034b50 ||
    view.getUint16(8, true) !== 0 ||
    view.getUint16(6, true) & 9 ||
    view.getUint32(14, true) !== entry.crc ||
    view.getUint16(26, true) !== path.length ||
    sizes.some((size) => size !== entry.size && size !== 0xffffffff) ||
    entry.at + start + entry.size > entry.next
  ) {
    refuse(name, `${path} has another size, CRC or kind at its place than in the directory, or reaches into what follows`);
  }
  return start;
}

/**
 * A file: where its local header is, where the next one begins, and its size.
 * @typedef {{at: number, next: number, size: number, crc: number}} Entry
 */

/** @param {string} name @param {Bytes} bytes @param {AbortSignal} [signal] @returns {Promise<Map<string, Entry>>} */
async function directory(name, bytes, signal) {
  const from = Math.max(0, bytes.size - TAIL);
  const tail = await gather(name, bytes, from, bytes.size, signal);
  let end = tail.length - END;
  const view = new DataView(tail.buffer);
  while (end >= 0 && (view.getUint32(end, true) !== 0x06054b50 || view.getUint16(end + 20, true) !== tail.length - END - end)) end--;
  if (end < 0) refuse(name, "it is no zip, or is cut off");
  let count = view.getUint16(end + 10, true);
  let size = view.getUint32(end + 12, true);
  let at = view.getUint32(end + 16, true);
  let stop = from + end;
  const far = end - LOCATOR - END64;
  if (far >= 0 && view.getUint32(end - LOCATOR, true) === 0x07064b50 && view.getUint32(far, true) === 0x06064b50) {
    count = Number(view.getBigUint64(far + 32, true));
    size = Number(view.getBigUint64(far + 40, true));
    at = Number(view.getBigUint64(far + 48, true));
    stop = from + far;
  }
  if (size > LARGEST_DIRECTORY || at + size !== stop) refuse(name, "its directory is not where its end says");
  const text = at >= from ? tail.subarray(at - from, at - from + size) : await gather(name, bytes, at, stop, signal);
  return entriesOf(name, text, count, at);
}

/** @param {string} name @param {Uint8Array} text @param {number} count @param {number} stop */
function entriesOf(name, text, count, stop) {
  const view = new DataView(text.buffer, text.byteOffset, text.length);
  const found = /** @type {Map<string, Entry>} */ (new Map());
  let at = 0;
  for (let i = 0; i < count; i++) {
    if (at + ENTRY > text.length || view.getUint32(at, true) !== 0x02014b50) refuse(name, `entry ${i} of its directory is none`);
    const [nameSize, extraSize, commentSize] = [28, 30, 32].map((each) => view.getUint16(at + each, true));
    const next = at + ENTRY + nameSize + extraSize + commentSize;
    if (next > text.length) refuse(name, `entry ${i} of its directory is cut off`);
    const path = String.fromCharCode(...text.subarray(at + ENTRY, at + ENTRY + nameSize));
    const [packed, size, header] = large(view, at, at + ENTRY + nameSize, extraSize);
    if (view.getUint16(at + 10, true) || packed !== size || view.getUint16(at + 8, true) & 9) {
      refuse(name, `${path} is compressed, encrypted, or has its size behind it`);
    }
    if (found.has(path)) refuse(name, `${path} is there twice`);
    found.set(path, { at: header, next: stop, size, crc: view.getUint32(at + 16, true) });
    at = next;
  }
  if (at !== text.length) refuse(name, "its directory has bytes behind its entries");
  const order = [...found].sort(([, a], [, b]) => a.at - b.at);
  order.forEach(([path, entry], i) => {
    entry.next = i + 1 < order.length ? order[i + 1][1].at : stop;
    if (!(entry.at + HEADER + path.length + entry.size <= entry.next)) refuse(name, `${path} reaches into what follows`);
  });
  return found;
}

/**
 * Both sizes and the place of an entry. What does not fit 32 bits stands in the extra field 1.
 * @param {DataView} view @param {number} at @param {number} extra @param {number} extraSize
 */
function large(view, at, extra, extraSize) {
  const values = [20, 24, 42].map((each) => view.getUint32(at + each, true));
  for (let field = extra; field + 4 <= extra + extraSize; field += 4 + view.getUint16(field + 2, true)) {
    if (view.getUint16(field, true) !== 1) continue;
    let from = field + 4;
    // The field has the size first, then the packed size, then the place; each only if it is needed.
    for (const each of [1, 0, 2]) {
      if (values[each] !== 0xffffffff || from + 8 > extra + extraSize) continue;
      values[each] = Number(view.getBigUint64(from, true));
      from += 8;
    }
  }
  return values;
}

/** @param {string} name @param {Bytes} bytes @param {number} from @param {number} to @param {AbortSignal} [signal] */
async function gather(name, bytes, from, to, signal) {
  const all = new Uint8Array(to - from);
  let at = 0;
  for await (const piece of bytes.part(from, to, signal)) {
    if (at + piece.length > all.length) refuse(name, "more bytes arrive than were asked for");
    all.set(piece, at);
    at += piece.length;
  }
  if (at !== all.length) refuse(name, `it ends after ${from + at} bytes`);
  return all;
}

/** @param {string} name @param {string} problem @returns {never} */
function refuse(name, problem) {
  throw new VolpkgError("VP4002", { path: name, problem: `it is neither a folder nor a sound zip: ${problem}` });
}
