/** The manifest: from bytes that nobody vouches for to a record whose fields are what this reader expects. */
import { VolpkgError } from "./error.js";

/** @typedef {import("./types.js").Manifest} Manifest */
/** @typedef {(value: any) => boolean} Test */
/**
 * What a value must be: what a test finds, a list of one shape, or an object, whose "key?" may be absent.
 * @typedef {Test | ShapeList | ShapeObject} Shape
 */
/** @typedef {Shape[]} ShapeList */
/** @typedef {{[key: string]: Shape}} ShapeObject */

export const MAX_MANIFEST_BYTES = 4 << 20;
const SIZE = 2 ** 31 - 1;

/** @type {Test} */
export const text = (v) => typeof v === "string";
/** @type {Test} */
export const number = (v) => Number.isFinite(v);
/** @type {Test} */
export const positive = (v) => Number.isFinite(v) && v > 0;
/** @type {Test} */
export const whole = (v) => Number.isSafeInteger(v) && v >= 0;
/** @type {Test} */
export const count = (v) => Number.isSafeInteger(v) && v > 0 && v <= SIZE;
/** @type {Test} */
export const path = (v) => text(v) && /^[a-z0-9_-]+(\.[a-z0-9_-]+)*(\/[a-z0-9_-]+(\.[a-z0-9_-]+)*)*$/.test(v);
/** @type {Test} */ const digest = (v) => text(v) && /^[0-9a-f]{64}$/.test(v);
/** @param {string} words @returns {Test} */
export const among = (words) => (v) => words.split(" ").includes(v);
/** @param {number} n @param {Test} each @returns {Test} */
export const tuple = (n, each) => (v) => Array.isArray(v) && v.length === n && v.every(each);
export const three = tuple(3, number);
export const counts = tuple(3, count);

const GRID = { shape_zyx: counts, spacing_mm_zyx: tuple(3, positive), origin_mm_xyz: three, direction: tuple(3, three), extent_mm_zyx: tuple(3, positive) };
const FUNCTION = { name: text, points: [{ value: number, colour: three, extinction_per_mm: number }], "reference_mm?": positive, "isovalue?": number };
const GL = { target: among("TEXTURE_2D TEXTURE_3D"), internal_format: text, "format?": text, "type?": text };
const SOURCES = "box_from_clip step_mm texture_from_box mipmap blocks_from_box block_low_mm block_high_mm split_voxel low_start_voxel low_size_voxels high_start_voxel high_size_voxels clip_from_box box_from_mesh box_from_slices slices first_sample light_mm box_from_light light_from_box picture_width picture_height";
const UNIFORMS = [{ name: text, type: among("float vec3 mat4"), source: among(SOURCES) }];
export const PROGRAM = {
  name: text,
  sampling: among("texture3d mosaic subvolumes bricks"),
  "technique?": text,
  "classification?": text,
  "compositing?": text,
  "light?": { place_mm_xyz: three },
  "rays?": among("box mesh"),
  vertex: path,
  fragment: path,
  levels: [whole],
  transfer: text,
  uniforms: UNIFORMS,
  samplers: [{ name: text, role: among("volume bricks transfer preintegrated skip normals subvolume"), "transfer?": text, "part?": whole }],
  "step_mm_min?": number,
  // What more there is to them is checked where they are drawn.
  "before?": [{ vertex: path, fragment: path, sampler: text, uniforms: UNIFORMS }],
};
const MOSAIC = { tile_shape_yx: tuple(2, count), slices: count, "gutter?": whole, "padding_yx?": tuple(2, whole), tiles_x: count, tiles_y: count, texture_shape_yx: tuple(2, count) };
/** Keys of parts of which few packages have any. What they hold: parts.js. */
const PARTS = ["skipping", "editing", "subvolumes", "proxy"];
/** @type {ShapeObject} */
const MANIFEST = {
  name: text,
  profile: { name: text, api: among("es1.1 es2.0 es3.0"), max_texture_bytes: count },
  grid: GRID,
  "together?": { name: text, transfers: [text] },
  render: { step_mm: positive, "level_steps?": [{ level: whole, step_mm: positive }], "opacity_cutoff?": number, "projection?": among("orthographic perspective") },
  channels: [
    {
      name: text,
      quantization: { bits: count, window: tuple(2, number) },
      levels: [{ index: whole, factors_zyx: counts, grid: GRID, texture_from_box_per_mm_xyz: three, filter: text }],
      transfer_functions: [FUNCTION],
    },
  ],
  textures: [
    {
      name: text,
      role: text,
      file: path,
      shape_zyx: counts,
      gl: GL,
      "filter?": among("linear nearest"),
      "level?": whole,
      "channels?": [text],
      "transfer?": text,
      "part?": whole,
      "mipmap?": whole,
      "mosaic?": MOSAIC,
      "max_extinction_per_mm?": number,
    },
  ],
  programs: [PROGRAM],
  "preview?": path,
  files: [{ path, role: text, size_bytes: whole, sha256: digest }],
};

/**
 * @param {Uint8Array} bytes at most MAX_MANIFEST_BYTES
 * @param {string} name of the package, for messages
 * @returns {Promise<Manifest>}
 */
export async function decodeManifest(bytes, name) {
  /** @type {any} */
  let record;
  try {
    const json = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(bytes);
    record = JSON.parse(json);
    if (repeatsKey(json)) throw new Error("a key stands twice in one object");
  } catch (error) {
    refuse(name, `manifest.json is not JSON: ${/** @type {Error} */ (error).message}`);
  }
  if (record?.format !== "volpkg") refuse(name, 'manifest.json does not say "format": "volpkg"');
  const { version } = record;
  if (!text(version) || !/^\d{1,4}\.\d{1,4}$/.test(version)) refuse(name, "manifest.json has no version of the form major.minor");
  if (!version.startsWith("1.")) throw new VolpkgError("VP4003", { path: name, version, known: "1.x" });
  if (record.state === "draft") throw new VolpkgError("VP4005", { path: name });
  const parts = PARTS.some((key) => Object.hasOwn(record, key)) ? await import("./parts.js") : null;
  const problem = record.state === "sealed" ? breach(record, { ...MANIFEST, ...parts?.PARTS }, "") : "state is neither draft nor sealed";
  if (problem) throw new VolpkgError("VP4004", { path: name, problems: problem });
  const contradiction = contradictions(record, parts?.usesOf(record) ?? []).next().value;
  if (contradiction) throw new VolpkgError("VP4011", { path: name, problem: contradiction });
  if (/** @type {Manifest} */ (record).textures.some(({ gl }) => gl.format === undefined)) await import("./blocks.js");
  return record;
}

/** @param {string} name @param {string} problem @returns {never} */
function refuse(name, problem) {
  throw new VolpkgError("VP4002", { path: name, problem });
}

/**
 * What breaks the shape first, or nothing.
 * @param {any} value @param {Shape} shape @param {string} at
 * @returns {string | undefined}
 */
export function breach(value, shape, at) {
  if (typeof shape === "function") return shape(value) ? undefined : `${at || "the whole"} is missing or of the wrong kind`;
  if (Array.isArray(shape)) {
    if (!Array.isArray(value)) return `${at} is no list`;
    for (let i = 0; i < value.length; i++) {
      const found = breach(value[i], shape[0], `${at}[${i}]`);
      if (found) return found;
    }
    return undefined;
  }
  if (typeof value !== "object" || value === null || Array.isArray(value)) return `${at || "the whole"} is no object`;
  for (const [key, inner] of Object.entries(shape)) {
    const name = key.replace("?", "");
    if (!Object.hasOwn(value, name) && name !== key) continue;
    const found = breach(Object.hasOwn(value, name) ? value[name] : undefined, inner, at ? `${at}.${name}` : name);
    if (found) return found;
  }
  return undefined;
}

/**
 * Whether an object of a JSON text has a key twice: JSON.parse takes the last one, other parsers the first.
 * @param {string} json that JSON.parse takes
 */
function repeatsKey(json) {
  /** @type {(Set<string> | null)[]} */
  const open = [];
  const tokens = /"(?:[^"\\]|\\.)*"(\s*:)?|[{}[\]]/g;
  for (let token = tokens.exec(json); token; token = tokens.exec(json)) {
    const [word, colon] = token;
    if (word === "{" || word === "[") open.push(word === "{" ? new Set() : null);
    else if (word === "}" || word === "]") open.pop();
    else if (colon) {
      const keys = /** @type {Set<string>} */ (open.at(-1));
      const key = JSON.parse(word.slice(0, -colon.length));
      if (keys.has(key)) return true;
      keys.add(key);
    }
  }
  return false;
}

/** A file, and the role in which it is used. @typedef {[file: string, role: string]} Use */

/** Files of programs and of the passes before them. @param {import("./types.js").Program[]} programs @returns {Use[]} */
export const shadersOf = (programs) => programs.flatMap((each) => [each, ...(each.before ?? [])].flatMap(({ vertex, fragment }) => /** @type {Use[]} */ ([[vertex, "shader"], [fragment, "shader"]])));

/** @param {Manifest} manifest @param {Use[]} more what parts use @returns {Generator<string, void>} */
function* contradictions(manifest, more) {
  const { files, textures, channels, programs, proxy, preview } = manifest;
  const roles = new Map(files.map((each) => [each.path, each.role]));
  for (const [what, names] of Object.entries({
    files: files.map((each) => each.path),
    textures: textures.map((each) => each.name),
    programs: programs.map((each) => each.name),
    channels: channels.map((each) => each.name),
    "transfer functions": channels.flatMap((each) => each.transfer_functions.map((one) => one.name)),
  })) {
    if (new Set(names).size < names.length) yield `two ${what} have one name`;
  }
  if (!channels.length || !textures.length) yield "it is sealed without channels or textures";
  if (!programs.length && manifest.profile.api !== "es1.1") yield "it is sealed without programs";
  const uses = [...textures.map((each) => [each.file, "texture"]), ...shadersOf(programs), ...(preview ? [[preview, "preview"]] : []), ...more];
  for (const [file, role] of uses) if (roles.get(file) !== role) yield `${file} is used as ${role}, but is ${roles.get(file) ?? "not among the files"}`;
  for (const each of textures) {
    if (each.gl.target === "TEXTURE_2D" && each.shape_zyx[0] !== 1) yield `texture ${each.name} is 2D, but has ${each.shape_zyx[0]} slices`;
    if (each.mosaic && each.mosaic.texture_shape_yx.some((n, i) => n !== each.shape_zyx[i + 1])) yield `texture ${each.name} has another shape than its mosaic`;
  }
  for (const { name, quantization, levels, transfer_functions } of channels) {
    if (!levels.length || !transfer_functions.length) yield `channel ${name} has no levels or no transfer functions`;
    if (quantization.window[0] >= quantization.window[1]) yield `channel ${name} has an empty window`;
  }
  for (const each of [...programs, ...(proxy?.programs ?? [])]) if (!each.levels.length) yield `program ${each.name} draws no level`;
  const names = new Set(textures.map((each) => each.name));
  for (const { texture } of [...(manifest.skipping?.tables ?? []), ...(manifest.skipping?.ranges ?? [])]) {
    if (!names.has(texture)) yield `empty-space skipping names the texture ${texture}, which is not there`;
  }
}
