/** Bricks from a server: neighbours come with one request, and each is checked and unpacked by itself. */
import { VolpkgError } from "../core/messages.js";
import { crcOf } from "../net/zip.js";
import { unpacked } from "../net/zstd.js";

/** @typedef {import("./brick_index.js").BrickIndex} BrickIndex */

/** Bricks this close are joined: the gap costs less than another request. */
const GAP = 1 << 14;
const MOST_JOINED = 1 << 20;
/** Requests at a time. */
const MOST_OPEN = 4;
/** Milliseconds of unpacking between two frames. */
const MOST_MS = 6;

/**
 * Fetches bricks, most wanted first, and gives each as soon as it is there.
 * @param {BrickIndex} index @param {number[]} wanted @param {AbortSignal} signal
 * @param {(brick: number, texels: Uint8Array) => void} give
 * @param {(brick: number, error: unknown, lasts: boolean) => void} fail lasts: the brick itself is damaged
 * @param {() => void} turn called after each request, and before others may use the thread
 */
export async function fetchBricks(index, wanted, signal, give, fail, turn) {
  const groups = joined(index, wanted);
  let next = 0;
  const work = async () => {
    while (next < groups.length && !signal.aborted) {
      const group = groups[next++];
      try {
        await fetchGroup(index, group, signal, give, fail, turn);
      } catch (error) {
        if (signal.aborted) return;
        // Requests that fail together may succeed alone.
        if (group.length > 1) groups.push(...group.map((brick) => [brick]));
        else fail(group[0], error, false);
      }
      turn();
    }
  };
  await Promise.all(Array.from({ length: MOST_OPEN }, work));
}

/** Bricks in groups of neighbours, in the order of the first of each. @param {BrickIndex} index @param {number[]} wanted */
function joined({ begin, size }, wanted) {
  /** @type {number[][]} */
  const groups = [];
  const rank = new Map(wanted.map((brick, i) => [brick, i]));
  for (const brick of [...wanted].sort((a, b) => a - b)) {
    const group = groups[groups.length - 1];
    const last = group?.[group.length - 1];
    const near = group && begin[brick] - begin[last] - size[last] <= GAP;
    if (near && begin[brick] + size[brick] - begin[group[0]] <= MOST_JOINED) group.push(brick);
    else groups.push([brick]);
  }
  const first = (/** @type {number[]} */ group) =>
    group.reduce((least, each) => Math.min(least, rank.get(each) ?? 0), Infinity);
  return groups.sort((a, b) => first(a) - first(b));
}

/**
 * @param {BrickIndex} index @param {number[]} group neighbours @param {AbortSignal} signal
 * @param {(brick: number, texels: Uint8Array) => void} give
 * @param {(brick: number, error: unknown, lasts: boolean) => void} fail @param {() => void} turn
 */
async function fetchGroup(index, group, signal, give, fail, turn) {
  const { begin, size, pack, layout } = index;
  const start = begin[group[0]];
  const last = group[group.length - 1];
  const bytes = new Uint8Array(begin[last] + size[last] - start);
  const whole = pack.size(layout.bricks);
  let [at, sent] = [start, 0];
  const range = { range: `bytes=${start}-${start + bytes.length - 1}` };
  const pieces = [];
  for await (const piece of pack.part(layout.bricks, range, signal)) {
    pieces.push(piece.slice());
    sent += piece.length;
  }
  // A server that does not know ranges sends all of the file.
  if (sent === whole && sent !== bytes.length) at = 0;
  else if (sent !== bytes.length)
    throw new VolpkgError("VP4008", { path: pack.name, file: layout.bricks, size: sent, expected: bytes.length });
  for (const piece of pieces) {
    const from = Math.max(start - at, 0);
    const part = piece.subarray(from, Math.max(start + bytes.length - at, from));
    if (part.length) bytes.set(part, at + from - start);
    at += piece.length;
  }
  let since = performance.now();
  for (const brick of group) {
    if (performance.now() - since > MOST_MS) {
      turn();
      await new Promise((resolve) => setTimeout(resolve));
      since = performance.now();
    }
    try {
      give(brick, texels(index, brick, bytes.subarray(begin[brick] - start, begin[brick] - start + size[brick])));
    } catch (error) {
      fail(brick, error, true);
    }
  }
}

/** The texels of a brick. @param {BrickIndex} index @param {number} brick @param {Uint8Array} data */
function texels(index, brick, data) {
  const { layout, pack, pitch, crc, begin } = index;
  const damaged = (/** @type {string} */ error) => {
    const level = index.levelOf(brick);
    const [z, y, x] = index.placeOf(brick, level);
    const where = { path: pack.name, file: layout.bricks, begin: begin[brick], level, x, y, z };
    return new VolpkgError("VP5043", { ...where, error });
  };
  const found = ~crcOf(data, -1) >>> 0;
  if (found !== crc[brick]) throw damaged(`its CRC-32 is ${hex(found)} instead of ${hex(crc[brick])}`);
  const count = pitch ** 3;
  const width = layout.format === "r8unorm" ? 1 : 2;
  const planes = unpacked(data, count * width, layout.bricks);
  if (width === 1) {
    for (let i = 1; i < count; i++) planes[i] += planes[i - 1];
    return planes;
  }
  const joined = new Uint8Array(2 * count);
  for (let i = 0, low = 0, high = 0; i < count; i++) {
    joined[2 * i] = low = (low + planes[i]) & 255;
    joined[2 * i + 1] = high = (high + planes[count + i]) & 255;
  }
  return joined;
}

/** @param {number} value */
const hex = (value) => value.toString(16).padStart(8, "0");
