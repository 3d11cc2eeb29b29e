/** The manifest: from bytes that nobody vouches for to a record whose fields are what this reader expects. */
import { VolpkgError } from "./error.js";
import { PROGRAM, among, breach, count, counts, number, path, positive, shadersOf, text, three, tuple, whole } from "./shapes.js";

/** @typedef {import("./types.js").Manifest} Manifest */
/** @typedef {import("./shapes.js").Test} Test */
/** @typedef {import("./shapes.js").ShapeObject} ShapeObject */
/** @typedef {import("./shapes.js").Use} Use */

export const MAX_MANIFEST_BYTES = 4 << 20;
/** @type {Test} */ const digest = (v) => text(v) && /^[0-9a-f]{64}$/.test(v);
const GRID = { shape_zyx: counts, spacing_mm_zyx: tuple(3, positive), origin_mm_xyz: three, direction: tuple(3, three), extent_mm_zyx: tuple(3, positive) };
const FUNCTION = { name: text, points: [{ value: number, colour: three, extinction_per_mm: number }], "reference_mm?": positive, "isovalue?": number };
const GL = { target: among("TEXTURE_2D TEXTURE_3D"), internal_format: text, "format?": text, "type?": text };
/** Keys of what few packages have. What they hold: parts.js. */
const PARTS = ["skipping", "editing", "subvolumes", "proxy", "mosaic", "together", "light", "before", "light_pass"];
/** @type {ShapeObject} */
const MANIFEST = {
  name: text,
  profile: { name: text, api: among("es1.1 es2.0 es3.0"), max_texture_bytes: count },
  grid: GRID,
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
  let written = "";
  try {
    const json = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(bytes);
    record = JSON.parse(json);
    if (repeatsKey(json)) throw new Error("a key stands twice in one object");
    // Keys without the escapes that a text may have.
    written = JSON.stringify(record);
  } catch (error) {
    refuse(name, `manifest.json is not JSON: ${/** @type {Error} */ (error).message}`);
  }
  if (record?.format !== "volpkg") refuse(name, 'manifest.json does not say "format": "volpkg"');
  const { version } = record;
  if (!text(version) || !/^\d{1,4}\.\d{1,4}$/.test(version)) refuse(name, "manifest.json has no version of the form major.minor");
  if (!version.startsWith("1.")) throw new VolpkgError("VP4003", { path: name, version, known: "1.x" });
  if (record.state === "draft") throw new VolpkgError("VP4005", { path: name });
  const parts = PARTS.some((key) => written.includes(`"${key}"`)) ? await import("./parts.js") : null;
  const problem = record.state === "sealed" ? (breach(record, MANIFEST, "") ?? breach(record, parts?.PARTS ?? {}, "")) : "state is neither draft nor sealed";
  if (problem) throw new VolpkgError("VP4004", { path: name, problems: problem });
  const contradiction = contradictions(record, parts?.usesOf(record) ?? []).next().value ?? parts?.contradictionOf(record);
  if (contradiction) throw new VolpkgError("VP4011", { path: name, problem: contradiction });
  if (/** @type {Manifest} */ (record).textures.some(({ gl }) => gl.format === undefined)) await import("./blocks.js");
  return record;
}

/** @param {string} name @param {string} problem @returns {never} */
function refuse(name, problem) {
  throw new VolpkgError("VP4002", { path: name, problem });
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

/** @param {Manifest} manifest @param {Use[]} more what parts use @returns {Generator<string, void>} */
function* contradictions(manifest, more) {
  const { files, textures, channels, programs, preview } = manifest;
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
  }
  for (const { name, quantization, levels, transfer_functions } of channels) {
    if (!levels.length || !transfer_functions.length) yield `channel ${name} has no levels or no transfer functions`;
    if (quantization.window[0] >= quantization.window[1]) yield `channel ${name} has an empty window`;
  }
  for (const each of programs) if (!each.levels.length) yield `program ${each.name} draws no level`;
}
