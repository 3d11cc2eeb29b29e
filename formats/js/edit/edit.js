/** Recomputes tables from the package's data after an edit of a transfer function. spec/editing.md. */
import { VolpkgError } from "../core/messages.js";
import { fromHalf } from "../gl/formats.js";
import { toHalf } from "../gl/halves.js";
import { fileOf, texelsOf } from "../net/kept_files.js";
import { texelBytes } from "../gl/ktx2.js";
import { entriesOf, skipEntries } from "./skip.js";

/** @typedef {import("../core/drawing.js").Choice} Choice */
/** @typedef {import("../core/package.js").Package} Package */
/** @typedef {import("../core/types.js").Channel} Channel */
/** @typedef {import("../core/types.js").Texture} Texture */
/** @typedef {import("../core/types.js").TransferFunction} TransferFunction */
/**
 * An edited function, and texels of the light that was computed again for it, by texture.
 * @typedef {TransferFunction & {lights?: Map<string, Uint8Array>, opacity?: number}} Edit
 */
/** Colour and extinction per millimetre of each entry, four numbers for one. @typedef {Float64Array} Table */
/** An edit that an app asks for. @typedef {{points: TransferFunction["points"], reference_mm?: number} | {opacity: number}} Wish */

const BINS = 256;
const WHOLE = 65535;
const LARGEST_HALF = 65504;
/** Upper limit of a voxel's opacity: denser voxels look the same. */
const MOST_OPAQUE = 1 - 2 ** -16;

/** Ratio of extinctions beyond which the colour of one side of a jump does not show beside it. */
const DENSER = 64;
/** Compositings where a value has the opacity of its function's `reference_mm`. */
const FIXED = ["maximum", "minimum", "average", "first-hit", "isosurface"];

/**
 * The transfer function that takes the place of another one. Throws VP5023 where that is not to be edited.
 * @param {Package} pack @param {Wish} edit @param {string} name
 * @returns {Edit}
 */
export function checkEdit(pack, edit, name) {
  const before = pack.transferFunctions.find((each) => each.name === name);
  if ("opacity" in edit) return fadedBy(pack, edit.opacity, name, before);
  const { points, reference_mm } = edit;
  if (!pack.manifest.editing || !before) throw new VolpkgError("VP5023", { path: pack.name });
  const problem =
    !Array.isArray(points) || !points.length
      ? "there are none"
      : points.map((each, i) => problemOf(each, points[i - 1])).find(Boolean);
  if (problem) throw new VolpkgError("VP7020", { problem });
  const length = before.reference_mm ?? 1;
  // A shader that knows no path has the length of the function that it was made for: opacities along it stay.
  const { pictures, programs } = pack.manifest;
  const shown = pictures.filter(({ media }) => media.some(({ transfer }) => transfer === name));
  const drawn = shown.flatMap(({ drawings }) => drawings.map(({ program }) => program));
  const fixed = programs.some((program) => drawn.includes(program.name) && FIXED.includes(program.compositing ?? ""));
  const ratio = fixed ? (reference_mm ?? length) / length : 1;
  return {
    name,
    reference_mm: length,
    points: points.map((point) => ({ ...point, extinction_per_mm: point.extinction_per_mm * ratio })),
  };
}

/**
 * The function of a channel that lies on a grid of its own, faded. Throws VP7084 for another one, or a number below 0.
 * @param {Package} pack @param {number} opacity @param {string} transfer @param {TransferFunction | undefined} before
 * @returns {Edit}
 */
function fadedBy({ manifest }, opacity, transfer, before) {
  const own = manifest.pictures.filter(({ grid, media }) => grid && media.length > 1);
  const isShown = own.some(({ media }) => media.some((medium) => medium.transfer === transfer));
  if (!before || !isShown || !(opacity >= 0 && Number.isFinite(opacity)))
    throw new VolpkgError("VP7084", { transfer, opacity });
  return { ...before, opacity };
}

/** Uniforms of media that are faded. @param {Package} pack @param {string} picture @param {Map<string, Edit>} edits */
function opacitiesOf({ manifest }, picture, edits) {
  const media = manifest.pictures.find(({ name }) => name === picture)?.media ?? [];
  const found = media.map(({ transfer }, i) => [`opacity_of_medium_${i}`, edits.get(transfer)?.opacity]);
  return Object.fromEntries(found.filter(([, opacity]) => opacity !== undefined));
}

/**
 * Points that are moved and stretched to a window of values. Throws VP7020 for a window without width.
 * @param {TransferFunction["points"]} points @param {{level: number, width: number}} window
 */
export function windowed(points, { level, width }) {
  const [first, last] = [points[0]?.value, points[points.length - 1]?.value];
  if (!(last > first && width > 0 && Number.isFinite(level)))
    throw new VolpkgError("VP7020", { problem: `a window of ${width} around ${level} does not fit them` });
  const moved = (/** @type {number} */ value) => level + width * ((value - first) / (last - first) - 0.5);
  return { points: points.map((point) => ({ ...point, value: moved(point.value) })) };
}

/** @param {any} point @param {any} before */
function problemOf(point, before) {
  const numbers = [point?.value, ...(point?.colour ?? [NaN]), point?.extinction_per_mm];
  if (numbers.length !== 5 || !numbers.every(Number.isFinite))
    return `${JSON.stringify(point)} is no value, colour of three and extinction_per_mm`;
  if (point.extinction_per_mm < 0 || point.colour.some((/** @type {number} */ value) => value < 0 || value > 1))
    return `${JSON.stringify(point)} has numbers out of range`;
  return before && before.value > point.value ? `${point.value} comes after ${before.value}` : "";
}

/**
 * A choice with the tables of edited functions in place of its own.
 * @param {Package} pack @param {Choice} choice @param {Map<string, Edit>} edits @param {AbortSignal} signal
 * @returns {Promise<Choice>}
 */
export async function edited(pack, choice, edits, signal) {
  const { picture, program, textures, level } = choice;
  const values = { ...choice.values, ...opacitiesOf(pack, picture, edits) };
  /** The edit of a function whose points are other ones. @param {string} transfer */
  const editOf = (transfer) => (edits.get(transfer)?.opacity === undefined ? edits.get(transfer) : undefined);
  if (!textures.some(({ role, transfer = picture }) => role === "transfer" && editOf(transfer)))
    return { ...choice, values };
  const texels = Object.assign(Object.create(null), choice.texels);
  /** Of each transfer function of the program: visibility of each entry. @type {[Channel, Float64Array][]} */
  const seen = [];
  for (const texture of textures.filter(({ role }) => role === "transfer")) {
    const { transfer = picture } = texture;
    const channel = pack.manifest.channels.find((channel) =>
      channel.transfer_functions.some(({ name }) => name === transfer),
    );
    const edit = editOf(transfer);
    if (!channel) throw new VolpkgError("VP5023", { path: pack.name });
    if (edit) texels[texture.name] = await tableTexels(pack, texture, channel, level.index, edit, signal);
    const bytes = texels[texture.name] ?? (await texelsOf(pack, texture, signal));
    const isovalue = channel.transfer_functions.find(({ name }) => name === transfer)?.isovalue ?? NaN;
    seen.push([
      channel,
      visible(extinctions(texture, bytes), program.compositing, channel.quantization.window, isovalue),
    ]);
  }
  const lights = edits.get(picture)?.lights;
  for (const texture of textures) {
    if (texture.role === "skip") texels[texture.name] = await skipTexels(pack, texture, seen, signal);
    if (texture.role === "light") texels[texture.name] = lights?.get(texture.name) ?? noLight(texture);
  }
  return { ...choice, texels, values, relit: Boolean(lights) };
}

/** Texels of a light of 1 everywhere: the stored light is of another function. @param {Texture} texture */
function noLight({ shape_zyx, gl, light }) {
  const { largest = 1, subtracted = 0 } = light ?? {};
  return new Uint8Array(texelBytes(gl.internal_format, shape_zyx)).fill(
    Math.min(Math.round((255 * (1 + subtracted)) / largest), 255),
  );
}

/**
 * @param {Package} pack @param {Texture} texture @param {Channel} channel @param {number} level
 * @param {TransferFunction} edit @param {AbortSignal} signal
 */
async function tableTexels(pack, texture, channel, level, edit, signal) {
  const { editing, pictures, grid } = pack.manifest;
  let table = lookup(edit, channel.quantization.window, texture.shape_zyx[2]);
  const histogram = editing?.histograms?.find(
    (histogram) => histogram.level === level && histogram.channel === channel.name,
  );
  if (histogram)
    table = ofLevel(shares(await fileOf(pack, histogram.file, signal), histogram.file), table, histogram.reference_mm);
  const half = texture.max_extinction_per_mm === undefined;
  // An extinction that is opaque after a quarter of a step, or of a shorter edge, needs no larger number.
  const shortest = Math.min(pictures[0].drawings[0].step_mm ?? Infinity, ...grid.extent_mm_zyx);
  const largest = texture.max_extinction_per_mm ?? Math.min(LARGEST_HALF, (-4 * Math.log1p(-MOST_OPAQUE)) / shortest);
  const value = (/** @type {number} */ each, /** @type {number} */ i) => (i % 4 < 3 ? each : Math.min(each, largest));
  if (half) return new Uint8Array(Uint16Array.from(table, (each, i) => toHalf(value(each, i))).buffer);
  return Uint8Array.from(table, (each, i) => round(255 * (i % 4 < 3 ? each : Math.sqrt(value(each, i) / largest))));
}

/** To the nearest whole number, half to even. @param {number} value */
export function round(value) {
  return value % 1 === 0.5 ? 2 * Math.round(value / 2) : Math.round(value);
}

/** The value of entry j. @param {readonly number[]} window @param {number} entries @param {number} j */
function valueOf([low, high], entries, j) {
  return j === entries - 1 ? high : low + ((high - low) / (entries - 1)) * j;
}

/**
 * The function at equal distances over the window, at a jump the mean of both sides: the entries of palettes.
 * @param {{points: TransferFunction["points"]}} edit @param {readonly number[]} window @param {number} entries
 * @returns {Table}
 */
export function sampled({ points }, window, entries) {
  const table = new Float64Array(4 * entries);
  const channels = points.map(({ colour, extinction_per_mm }) => [...colour, extinction_per_mm]);
  for (let j = 0; j < entries; j++) {
    const value = valueOf(window, entries, j);
    // The upper neighbour, as the limits from below and from above see it.
    const sides = [(/** @type {number} */ at) => at >= value, (/** @type {number} */ at) => at > value].map((is) => {
      const found = points.findIndex((point) => is(point.value));
      return between(points, channels, value, found < 0 ? points.length : found);
    });
    for (let c = 0; c < 4; c++) table[4 * j + c] = (sides[0][c] + sides[1][c]) / 2;
  }
  return table;
}

/**
 * A lookup table: beside a jump from haze to a wall it has the colour of the wall.
 * @param {TransferFunction} edit @param {readonly number[]} window @param {number} entries
 */
function lookup({ points }, window, entries) {
  const table = sampled({ points }, window, entries);
  for (let below = 0; below + 1 < points.length; below++) {
    if (points[below].value !== points[below + 1].value) continue;
    const [lower, upper] = [points[below].extinction_per_mm, points[below + 1].extinction_per_mm];
    const dense = upper >= lower ? below + 1 : below;
    const [faint, at] = [2 * below + 1 - dense, points[below].value];
    // Nearly all light of the ramp from haze to a wall is the wall's.
    if (DENSER * Math.min(lower, upper) >= Math.max(lower, upper)) continue;
    let first = 0;
    while (first < entries && valueOf(window, entries, first) < at) first++;
    const touches = first < entries && valueOf(window, entries, first) === at;
    if (faint === below) first--;
    for (let j = Math.max(first, 0); j <= Math.min(first + (touches ? 1 : 0), entries - 1); j++)
      table.set(points[dense].colour, 4 * j);
  }
  return table;
}

/** @param {TransferFunction["points"]} points @param {number[][]} channels @param {number} value @param {number} upper */
function between(points, channels, value, upper) {
  const [a, b] = [Math.max(upper - 1, 0), Math.min(upper, points.length - 1)];
  const distance = points[b].value - points[a].value;
  const weight = distance > 0 ? (value - points[a].value) / distance : 0;
  return channels[a].map((each, c) => each + weight * (channels[b][c] - each));
}

/** The matrix of a joint histogram, rows one after the other. @param {Uint8Array} bytes @param {string} path */
export function shares(bytes, path) {
  /** @param {string} problem @returns {never} */
  const refuse = (problem) => {
    throw new VolpkgError("VP4032", { path, problem });
  };
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const word = (/** @type {number} */ at) => view.getUint16(2 * at, true);
  const bands = Array.from({ length: bytes.length < 4 * BINS ? 0 : BINS }, (_, row) => [
    word(2 * row),
    word(2 * row + 1),
  ]);
  const entries = bands.reduce((sum, [, count]) => sum + count, 0);
  if (!bands.length || bytes.length !== 2 * (2 * BINS + entries))
    refuse(`it has ${bytes.length} bytes, which its bands do not take`);
  const matrix = new Uint16Array(BINS * BINS);
  let at = 2 * BINS;
  bands.forEach(([first, count], row) => {
    if (first + count > BINS) refuse("a band goes beyond the last column");
    let sum = 0;
    for (let column = first; column < first + count; column++) sum += matrix[BINS * row + column] = word(at++);
    if (sum !== WHOLE) refuse(`a row does not sum to ${WHOLE}`);
  });
  return matrix;
}

/** The table of a level. @param {Uint16Array} matrix @param {Table} table @param {number} length @returns {Table} */
function ofLevel(matrix, table, length) {
  const entries = table.length / 4;
  const at = Array.from({ length: entries }, (_, j) => ((BINS - 1) * j) / (entries - 1));
  const fine = binned(table, at, length);
  const coarse = new Float64Array(4 * BINS);
  for (let row = 0; row < BINS; row++) {
    for (let column = 0; column < BINS; column++) {
      const share = matrix[BINS * row + column];
      if (share) for (let c = 0; c < 4; c++) coarse[4 * row + c] += share * fine[4 * column + c];
    }
    for (let c = 0; c < 4; c++) coarse[4 * row + c] /= WHOLE;
  }
  const made = table.slice();
  at.forEach((place, j) => {
    const low = Math.min(Math.floor(place), BINS - 2);
    const light = [0, 1, 2, 3].map(
      (c) => coarse[4 * low + c] + (place - low) * (coarse[4 * low + 4 + c] - coarse[4 * low + c]),
    );
    if (light[3] > 0) for (let c = 0; c < 3; c++) made[4 * j + c] = Math.min(Math.max(light[c] / light[3], 0), 1);
    made[4 * j + 3] = -Math.log1p(-Math.min(light[3], MOST_OPAQUE)) / length;
  });
  return made;
}

/** Light and opacity of a path, as means around each bin. @param {Table} table @param {number[]} at of each entry, in bins @param {number} length */
function binned(table, at, length) {
  const reach = Math.max(1, at[1]);
  const means = new Float64Array(4 * BINS);
  for (let bin = 0; bin < BINS; bin++) {
    let sum = 0;
    at.forEach((place, j) => {
      const weight = Math.max(0, 1 - Math.abs(bin - place) / reach);
      if (!weight) return;
      sum += weight;
      const opacity = -Math.expm1(-table[4 * j + 3] * length);
      for (let c = 0; c < 4; c++) means[4 * bin + c] += weight * opacity * (c < 3 ? table[4 * j + c] : 1);
    });
    for (let c = 0; c < 4; c++) means[4 * bin + c] /= sum;
  }
  return means;
}

/** The extinction of each entry, as the shader reads it. @param {Texture} texture @param {Uint8Array} texels */
function extinctions({ max_extinction_per_mm: largest }, texels) {
  const entries = largest === undefined ? new Uint16Array(texels.buffer, texels.byteOffset, texels.length / 2) : texels;
  return Float64Array.from({ length: entries.length / 4 }, (_, j) =>
    largest === undefined ? fromHalf(entries[4 * j + 3]) : largest * (entries[4 * j + 3] / 255) ** 2,
  );
}

/**
 * Visibility of each entry of a table (spec/compositing.md). With a maximum an entry is visible if any lower value is; with
 * a surface only the entries beside the isovalue are visible.
 * @param {Float64Array} found @param {string | undefined} compositing @param {readonly number[]} window @param {number} isovalue
 */
export function visible(found, compositing, [low, high], isovalue) {
  const last = found.length - 1;
  const before = (/** @type {number} */ j) => j === 0 || low + ((high - low) / last) * (j - 1) < isovalue;
  const after = (/** @type {number} */ j) => j === last || isovalue < low + ((high - low) / last) * (j + 1);
  if (compositing === "maximum" || compositing === "mida")
    for (let j = 1; j <= last; j++) found[j] = Math.max(found[j], found[j - 1]);
  if (compositing === "minimum") for (let j = last - 1; j >= 0; j--) found[j] = Math.max(found[j], found[j + 1]);
  if (compositing === "average") found.fill(1);
  if (compositing === "first-hit") for (let j = 0; j <= last; j++) found[j] = Number(after(j));
  if (compositing === "isosurface") for (let j = 0; j <= last; j++) found[j] = Number(before(j) && after(j));
  return found;
}

/**
 * @param {Package} pack @param {Texture} texture the skip table's @param {[Channel, Float64Array][]} seen @param {AbortSignal} signal
 */
async function skipTexels(pack, texture, seen, signal) {
  const { skipping, grid, textures } = pack.manifest;
  const record = skipping?.tables?.find((table) => table.texture === texture.name);
  if (!record) throw new VolpkgError("VP5023", { path: pack.name });
  const [z, y, x] = record.blocks_zyx;
  const occupied = new Uint8Array(z * y * x);
  const threshold = -Math.log1p(-(skipping?.epsilon ?? 0) / seen.length) / Math.hypot(...grid.extent_mm_zyx);
  for (const [channel, extinction] of seen) {
    const found = (skipping?.ranges ?? []).filter(
      (range) => range.level === record.level && range.block === record.block,
    );
    const ranges = found
      .map((each) => textures.find(({ name }) => name === each.texture))
      .find((each) => !each?.channels?.length || each.channels.includes(channel.name));
    if (!ranges) throw new VolpkgError("VP5023", { path: pack.name });
    const codes = entriesOf(ranges, await texelsOf(pack, ranges, signal), [2 * z, y, x]);
    occupy(occupied, codes, extinction, threshold);
  }
  return skipEntries(occupied, record.blocks_zyx, record.kind, texture);
}

/**
 * Marks visible blocks.
 * @param {Uint8Array} occupied @param {Float64Array} codes normalised: the least of each block, then the greatest of each
 * @param {Float64Array} extinction of each entry @param {number} threshold
 */
function occupy(occupied, codes, extinction, threshold) {
  const last = extinction.length - 1;
  /** How many entries before each are seen. */
  const before = new Uint32Array(extinction.length + 1);
  extinction.forEach((each, j) => {
    before[j + 1] = before[j] + Number(each > threshold);
  });
  const within = (/** @type {number} */ entry) => Math.min(Math.max(entry, 0), last);
  for (let i = 0; i < occupied.length; i++) {
    const [low, high] = [codes[i] * last, codes[occupied.length + i] * last];
    // One entry wider, because of the rounding of float32.
    if (before[within(Math.ceil(high) + 1) + 1] > before[within(Math.floor(low) - 1)]) occupied[i] = 1;
  }
}
