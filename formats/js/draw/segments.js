/** Segments of a scan, and their looks: apps switch, tint and fade them. spec/segments.md. */
import { VolpkgError } from "../core/messages.js";
import { texelsOf } from "../net/kept_files.js";
import { skipEntries } from "../edit/skip.js";
import { toHalf } from "../gl/halves.js";

/** @typedef {import("../core/drawing.js").Choice} Choice */
/** @typedef {import("../core/package.js").Package} Package */
/** @typedef {import("../core/types.js").Manifest} Manifest */
/** @typedef {import("../core/types.js").Segment} Segment */
/** @typedef {import("../core/types.js").Texture} Texture */
/**
 * Look of a segment; absent fields keep their values.
 * @typedef {{visible?: boolean, tint?: readonly number[], opacity?: number}} Look
 */

const share = (/** @type {unknown} */ value) => typeof value === "number" && value >= 0 && value <= 1;

/** The looks of all segments, as an app has changed them. */
export class Segments {
  #record;
  /** By the name of the segment. @type {Map<string, Segment>} */
  #now;
  /** The skip table that was made last, by its name and the labels that are shown. @type {{key: string, texels: Uint8Array}} */
  #skip = { key: "", texels: new Uint8Array() };

  /** @param {Manifest} manifest @param {string} path for messages */
  constructor(manifest, path) {
    if (!manifest.segments) throw new VolpkgError("VP4014", { path, file: "segments" });
    this.#record = manifest.segments;
    this.#now = new Map(this.#record.segments.map((segment) => [segment.name, segment]));
  }

  /** Segments as they look now, in the order of the package. */
  get all() {
    return [...this.#now.values()];
  }

  /** @param {string} name @param {Look | null} look null restores the package's look */
  set(name, look) {
    const before = look ? this.#now.get(name) : this.#record.segments.find((segment) => segment.name === name);
    const { visible = true, tint = [1, 1, 1], opacity = 1, ...others } = look ?? {};
    const isTint = tint?.length === 3 && Array.from(tint).every(share);
    const isSound = typeof visible === "boolean" && isTint && share(opacity) && !Object.keys(others).length;
    if (!before || !isSound) {
      const known = [...this.#now.keys()].join(", ");
      const problem = before ? `a look cannot be ${JSON.stringify(look)}` : `the package has only ${known}`;
      throw new VolpkgError("VP7083", { name, problem });
    }
    this.#now.set(name, { ...before, ...look, ...(look?.tint && { tint: /** @type {any} */ ([...look.tint]) }) });
  }

  /** Codes of the table of looks: square roots, as bytes or half floats. @param {Texture} texture */
  codes({ format, shape_zyx: [, rows, columns] }) {
    const half = format === "rgba16float";
    const codes = new (half ? Uint16Array : Uint8Array)(4 * rows * columns);
    const code = (/** @type {number} */ root) => (half ? toHalf(root) : Math.round(255 * root));
    this.#record.labels.forEach(({ segments = [] }, label) => {
      const shown = segments
        .map((name) => /** @type {Segment} */ (this.#now.get(name)))
        .filter(({ visible = true }) => visible);
      const mean = (/** @type {number} */ c) =>
        shown.reduce((sum, { tint = [1, 1, 1] }) => sum + tint[c], 0) / shown.length;
      const inside = shown.length ? Math.max(...shown.map(({ opacity = 1 }) => opacity)) : 0;
      const tint = [0, 1, 2].map((c) => (shown.length ? mean(c) : 1));
      const opacity = segments.length ? inside : (this.#record.outside ?? 1);
      codes.set(
        [...tint, opacity].map((value) => code(Math.sqrt(value))),
        4 * label,
      );
    });
    return codes;
  }

  /**
   * A choice that draws segments as they look now, and skips the blocks in which none is shown.
   * @param {Package} pack @param {Choice} choice @param {AbortSignal} signal @returns {Promise<Choice>}
   */
  async shown(pack, choice, signal) {
    const { level, textures } = choice;
    const table = textures.find(({ role }) => role === "looks");
    if (!table) return choice;
    const looks = this.codes(table);
    const texels = Object.assign(Object.create(null), choice.texels, { [table.name]: new Uint8Array(looks.buffer) });
    const skip = textures.find(({ role }) => role === "skip");
    const sets = pack.manifest.textures.find(
      (texture) => texture.role === "label-sets" && texture.level === level.index,
    );
    const record = pack.manifest.skipping?.tables?.find((table) => table.texture === skip?.name);
    if (skip && sets && record) {
      const shown = this.#record.labels.map((_, label) => Number(looks[4 * label + 3] > 0));
      const key = `${skip.name} ${shown.join("")}`;
      // Tints and other opacities hide nothing.
      if (this.#skip.key !== key) {
        const [z, y, x] = record.blocks_zyx;
        const occupied = shownBlocks(await texelsOf(pack, sets, signal), z * y * x, looks);
        this.#skip = { key, texels: skipEntries(occupied, record.blocks_zyx, record.kind, skip) };
      }
      texels[skip.name] = this.#skip.texels;
    }
    return { ...choice, texels };
  }
}

/**
 * 1 for each block with a visible label. Labels and sets that a package does not list count as visible.
 * @param {Uint8Array} texels of the labels of blocks @param {number} blocks @param {Uint8Array | Uint16Array} looks codes
 */
function shownBlocks(texels, blocks, looks) {
  const list = new Uint16Array(texels.buffer, texels.byteOffset, texels.length / 2);
  const seen = [0];
  let shown = 0;
  for (let i = blocks; i < list.length; i++) {
    if (looks[4 * (list[i] & 0x7fff) + 3] !== 0) shown = 1;
    if (list[i] < 0x8000) continue;
    seen.push(shown);
    shown = 0;
  }
  return Uint8Array.from({ length: blocks }, (_, i) => seen[list[i]] ?? 1);
}
