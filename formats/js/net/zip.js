/** The single-file form of a package: the strict parse of spec/README.md, which leaves no byte unexplained. */
import { check } from "../core/abort.js";
import { VolpkgError } from "../core/error.js";

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
        check(signal);
        const piece = await slice(at, Math.min(at + PIECE, end));
        yield piece instanceof Uint8Array ? piece : new Uint8Array(piece);
      }
    },
  };
}

/** @param {string} name @param {Bytes} bytes @param {AbortSignal} [signal] @returns {Promise<Source>} */
export async function openZip(name, bytes, signal) {
  const entries = await directory(name, bytes, signal);
  return {
    name,
    joins: true,
    size: (path) => entries.get(path)?.size,
    async *stream(path, signal, range) {
      const entry = entries.get(path);
      if (!entry && path === "manifest.json") refuse(name, "it has no manifest.json");
      if (!entry) throw new VolpkgError("VP4007", { path: name, file: path, error: "not in the zip" });
      if (range) {
        const fixed = await gather(name, bytes, entry.at, entry.at + HEADER, signal);
        const head = HEADER + path.length + new DataView(fixed.buffer).getUint16(28, true);
        const data = entry.at + fileStart(name, path, await gather(name, bytes, entry.at, entry.at + head), entry);
        const [from, last] = (/(\d+)-(\d+)/.exec(range.range) ?? []).slice(1).map(Number);
        yield* bytes.part(data + from, data + last + 1, signal);
        return;
      }
      // The local header lies before the file; how much of it is padding it says itself. One request gets both.
      const room = HEADER + path.length;
      let head = new Uint8Array(room);
      let filled = 0;
      let start = 0;
      let given = 0;
      // The manifest has no digest. Those of other files are compared in its place.
      const checks = path === "manifest.json";
      let crc = -1;
      let at = 0;
      for await (let piece of bytes.part(entry.at, entry.next, signal)) {
        while (filled < head.length && at + piece.length > filled) {
          const taken = piece.subarray(filled - at, head.length - at);
          head.set(taken, filled);
          filled += taken.length;
          if (filled === room && head.length === room) {
            // The extra field after the name has the size of a file above 4 GB.
            const whole = new Uint8Array(room + new DataView(head.buffer).getUint16(28, true));
            whole.set(head);
            head = whole;
          }
        }
        if (filled < room || filled < head.length) {
          at += piece.length;
          continue;
        }
        start ||= fileStart(name, path, head, entry);
        const from = Math.max(start - at, 0);
        at += piece.length;
        piece = piece.subarray(from, from + entry.size - given);
        given += piece.length;
        if (checks) crc = crcOf(piece, crc);
        if (checks && given === entry.size && ~crc >>> 0 !== entry.crc) {
          await import("../core/messages.js");
          throw new VolpkgError("VP4061", { path: name, file: path });
        }
        if (piece.length) yield piece;
        if (given === entry.size) return;
      }
      if (!start) refuse(name, `${path} ends inside its header`);
    },
  };
}

/** Continues a CRC-32. @param {Uint8Array} bytes @param {number} crc of the preceding bytes, inverted */
export function crcOf(bytes, crc) {
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 && 0xedb88320);
  }
  return crc;
}

/**
 * Offset of a file's data after its local header, which must agree with the directory.
 * @param {string} name @param {string} path @param {Uint8Array} head @param {Entry} entry
 */
function fileStart(name, path, head, entry) {
  const view = new DataView(head.buffer);
  const [packed, size] = large(name, path, view, [18, 22], HEADER + path.length, view.getUint16(28, true));
  const written = String.fromCharCode(...head.subarray(HEADER, HEADER + path.length));
  if (
    view.getUint32(0, true) !== 0x04034b50 ||
    view.getUint16(8, true) !== 0 ||
    view.getUint16(6, true) !== entry.flags ||
    view.getUint32(14, true) !== entry.crc ||
    view.getUint16(26, true) !== path.length ||
    written !== path ||
    packed !== entry.size ||
    size !== entry.size ||
    entry.at + head.length + entry.size !== entry.next
  ) {
    refuse(
      name,
      `${path} has another name, size, CRC or kind at its place than in the directory, or does not end where the next file begins`,
    );
  }
  return head.length;
}

/**
 * A file: where its local header is, where the next one begins, and its size.
 * @typedef {{at: number, next: number, size: number, crc: number, flags: number}} Entry
 */

/** @param {string} name @param {Bytes} bytes @param {AbortSignal} [signal] @returns {Promise<Map<string, Entry>>} */
async function directory(name, bytes, signal) {
  const from = Math.max(0, bytes.size - TAIL);
  const tail = await gather(name, bytes, from, bytes.size, signal);
  const end = tail.length - END;
  const view = new DataView(tail.buffer);
  if (end < 0 || view.getUint32(end, true) !== 0x06054b50 || view.getUint16(end + 20, true))
    refuse(name, "it is no zip whose end record is its last 22 bytes, without a comment");
  let count = view.getUint16(end + 10, true);
  let size = view.getUint32(end + 12, true);
  let at = view.getUint32(end + 16, true);
  let stop = from + end;
  if (view.getUint32(end + 4, true) || view.getUint16(end + 8, true) !== count)
    refuse(name, "it is one of several parts of a zip");
  if (end >= LOCATOR && view.getUint32(end - LOCATOR, true) === 0x07064b50) {
    const far = end - LOCATOR - END64;
    const words = [0, 8, 16, 24, 32, 40, 48].map((value) =>
      far < 0 ? -1 : Number(view.getBigUint64(far + value, true)),
    );
    const isPlaced =
      far >= 0 && view.getUint32(far, true) === 0x06064b50 && Number(view.getBigUint64(far + 4, true)) === END64 - 12;
    const isLocated =
      !view.getUint32(end - 16, true) &&
      Number(view.getBigUint64(end - 12, true)) === from + far &&
      view.getUint32(end - 4, true) === 1;
    const agrees = [
      count === words[4] || count === 0xffff,
      size === words[5] || size === 0xffffffff,
      at === words[6] || at === 0xffffffff,
    ];
    if (!isPlaced || !isLocated || words[2] || words[3] !== words[4] || agrees.includes(false))
      refuse(name, "its two end records differ");
    [count, size, at] = words.slice(4);
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
    if (at + ENTRY > text.length || view.getUint32(at, true) !== 0x02014b50)
      refuse(name, `place ${i} of its directory has no entry`);
    const [nameSize, extraSize, commentSize] = [28, 30, 32].map((value) => view.getUint16(at + value, true));
    const next = at + ENTRY + nameSize + extraSize + commentSize;
    if (next > text.length) refuse(name, `entry ${i} of its directory is cut off`);
    const path = String.fromCharCode(...text.subarray(at + ENTRY, at + ENTRY + nameSize));
    const [packed, size, header] = large(
      name,
      path,
      view,
      [at + 20, at + 24, at + 42],
      at + ENTRY + nameSize,
      extraSize,
    );
    const flags = view.getUint16(at + 8, true);
    if (view.getUint16(at + 10, true) || packed !== size || flags & ~0x800) {
      refuse(name, `${path} is compressed, encrypted, or has its size behind it`);
    }
    if (commentSize || view.getUint16(at + 34, true) || /[^\0-\x7f]/.test(path))
      refuse(name, `${path} has a comment, is in another part, or has a name that is not ASCII`);
    if (found.has(path)) refuse(name, `${path} is there twice`);
    found.set(path, { at: header, next: stop, size, crc: view.getUint32(at + 16, true), flags });
    at = next;
  }
  if (at !== text.length) refuse(name, "its directory has bytes behind its entries");
  const order = [...found].sort(([, a], [, b]) => a.at - b.at);
  if (order.length ? order[0][1].at : stop) refuse(name, "its first file does not begin at its first byte");
  order.forEach(([path, entry], i) => {
    entry.next = i + 1 < order.length ? order[i + 1][1].at : stop;
    if (!(entry.at + HEADER + path.length + entry.size <= entry.next))
      refuse(name, `${path} overlaps the next file or the directory`);
  });
  return found;
}

/**
 * Both sizes and the offset of an entry. Values above 32 bits are in the extra field 1.
 * @param {string} name @param {string} path @param {DataView} view @param {number[]} places of packed size, size and, in
 *   the directory, header @param {number} extra @param {number} extraSize
 */
function large(name, path, view, places, extra, extraSize) {
  const values = places.map((place) => view.getUint32(place, true));
  const end = extra + extraSize;
  let [from, to] = [0, 0];
  let field = extra;
  for (let next; field + 4 <= end; field = next) {
    next = field + 4 + view.getUint16(field + 2, true);
    if (view.getUint16(field, true) !== 1) continue;
    if (from) refuse(name, `${path} has damaged extra fields`);
    [from, to] = [field + 4, next];
  }
  if (field !== end) refuse(name, `${path} has damaged extra fields`);
  // The field has the size first, then the packed size, then the place; each only if it is needed.
  for (const value of [1, 0, 2]) {
    if (values[value] !== 0xffffffff) continue;
    if (!from || from + 8 > to) refuse(name, `${path} has damaged extra fields`);
    values[value] = Number(view.getBigUint64(from, true));
    from += 8;
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
