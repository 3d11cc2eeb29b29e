/** Checks of an untrusted manifest: JSON with the limits of spec/README.md, and rules of docs/CHECKS.md. */
import { VolpkgError } from "./error.js";
import { INTERNAL, uploadOf } from "../gl/formats.js";
import { contradictionOf, usesOf } from "./parts.js";
import { ROLES, SCHEMA } from "../schema.js";
import { has, shadersOf } from "./shapes.js";

/** @typedef {import("./shapes.js").Use} Use */
/** @typedef {import("./types.js").Manifest} Manifest */

const TOKENS = /"(?:[^"\\]|\\.)*"(\s*:)?|[{}[\]]|-?\d[\d.eE+-]*/g;

/**
 * Parses JSON that has one meaning for all parsers. Throws an Error otherwise: JSON.parse takes the last of two equal
 * keys, and other parsers the first.
 * @param {Uint8Array} bytes
 * @returns {any}
 */
export function parseJson(bytes) {
  const text = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(bytes);
  const value = JSON.parse(text);
  /** @type {Set<string>[]} */
  const open = [];
  for (const [token, colon] of text.matchAll(TOKENS)) {
    const keys = open[open.length - 1];
    let breach =
      /^[-\d]/.test(token) && (/\d{257}/.test(token) || (/^-?\d+$/.test(token) && !Number.isSafeInteger(+token)));
    if (/[{[]/.test(token[0])) breach = open.push(new Set()) > 32;
    else if (/[}\]]/.test(token[0])) open.pop();
    else if (keys && (colon || /\\u/.test(token))) {
      const word = JSON.parse(token.replace(/\s*:$/, ""));
      // A zero character, or half of a surrogate pair.
      breach = /[\0\ud800-\udfff]/u.test(word) || (!!colon && (keys.has(word) || keys.add(word).size > 256));
    }
    if (breach) throw new Error(`${token.slice(0, 40)} is twice in one object, too much, or no value`);
  }
  return value;
}

/** @typedef {(value: any) => boolean} Test */
const text = (/** @type {any} */ v) => typeof v === "string";
/** Tests of the one-letter types of schema.js, and of numbers within bounds. @type {Record<string, Test>} */
const TESTS = {
  s: text,
  b: (v) => v === true || v === false,
  a: () => true,
  p: (v) =>
    text(v) &&
    /^[a-z0-9_-]+(\.[a-z0-9_-]+)*(\/[a-z0-9_-]+(\.[a-z0-9_-]+)*)*$/.test(v) &&
    !/(^|\/)(con|prn|aux|nul|(com|lpt)[1-9])(\.|\/|$)/.test(v),
  h: (v) => text(v) && /^[0-9a-f]{64}$/.test(v),
  c: (v) => text(v) && /^[a-z0-9][a-z0-9_-]{0,59}$/.test(v),
  v: (v) => text(v) && /^1\.(?!0\d)\d{1,4}$/.test(v),
  n: Number.isFinite,
  ...Object.fromEntries(
    Object.entries({
      P: "(<0,)",
      N: "(0,)",
      F: "(0,1)",
      i: "#(-2147483647,2147483647)",
      U: "#(0,2147483647)",
      I: "#(1,2147483647)",
      B: "#(0,9007199254740991)",
    }).map(([name, bounds]) => [name, within(bounds)]),
  ),
};

/** Test of a number within bounds, as schema.js writes them. @param {string} bounds @returns {Test} */
function within(bounds) {
  const [, low, high] = /** @type {RegExpExecArray} */ (/\((.*),(.*)\)/.exec(bounds));
  const [from, to] = [low, high].map((each) => each.replace("<", ""));
  return (v) =>
    (bounds[0] === "#" ? Number.isSafeInteger(v) : Number.isFinite(v)) &&
    !(from && (low[0] === "<" ? v <= +from : v < +from)) &&
    !(to && (high[0] === "<" ? v >= +to : v > +to));
}

/**
 * The first violation of a type of schema.js, or undefined.
 * @param {any} value @param {string} type @param {string} at
 * @returns {string | undefined}
 */
export function schemaBreach(value, type, at) {
  if (type.endsWith("~")) return value === null ? undefined : schemaBreach(value, type.slice(0, -1), at);
  const list = /^(?:\*(?:\((\d+),(\d*)\))?|(\d))(.*)$/.exec(type);
  if (list) {
    const [, least = 0, most = "", exact, item] = list;
    if (
      !Array.isArray(value) ||
      (exact ? value.length !== +exact : value.length < +least || (most && value.length > +most))
    )
      return `${at} has another number of entries`;
    return firstBreach(value, (each, i) => schemaBreach(each, item, `${at}.${i}`));
  }
  if (/^#?=/.test(type))
    return type
      .replace(/^#?=/, "")
      .split("|")
      .includes(type[0] === "#" ? `${value}` : value) &&
      (type[0] !== "#" || Number.isFinite(value))
      ? undefined
      : `${at} is not one of its words`;
  if (has(TESTS, type)) return TESTS[type](value) ? undefined : `${at} is missing or of the wrong kind`;
  if (type.includes("(")) return within(type)(value) ? undefined : `${at} is out of range`;
  if (typeof value !== "object" || value === null || Array.isArray(value)) return `${at} is no object`;
  if (type.includes("/")) return text(value.kind) ? undefined : `${at}.kind is missing`;
  return firstBreach(SCHEMA[type].split("; "), (field) => {
    const [, key, absent, inner] = /** @type {RegExpExecArray} */ (/^(\w+)(\??): (.*)$/.exec(field));
    if (has(value, key)) return schemaBreach(value[key], inner, at ? `${at}.${key}` : key);
    return absent ? undefined : `${at}.${key} is missing`;
  });
}

/** @template T @param {T[]} all @param {(each: T, i: number) => string | undefined} breachOf */
function firstBreach(all, breachOf) {
  for (let i = 0; i < all.length; i++) {
    const found = breachOf(all[i], i);
    if (found) return found;
  }
  return undefined;
}

/** Rules that concern several fields. @param {any} manifest @returns {string | undefined} */
function recordBreach({ grid, pictures = [], channels = [] }) {
  const grids = [
    grid ?? [],
    ...pictures.map((/** @type {any} */ picture) => picture.grid ?? []),
    ...channels.flatMap((/** @type {any} */ channel) => [
      channel.source.info.grid,
      ...(channel.levels ?? []).map((/** @type {any} */ level) => level.grid),
    ]),
  ].flat();
  for (const { direction } of grids) {
    for (const i of [0, 1, 2]) {
      for (const k of [0, 1, 2]) {
        const sum = [0, 1, 2].reduce((all, row) => all + direction[row][i] * direction[row][k], i === k ? -1 : 0);
        if (!(Math.abs(sum) <= 1e-6)) return "direction must have orthonormal columns";
      }
    }
  }
  for (const { name, points } of channels.flatMap((/** @type {any} */ channel) => channel.transfer_functions ?? [])) {
    if (
      points.some(
        (/** @type {any} */ point, /** @type {number} */ i) =>
          i && (points[i - 1].value > point.value || (i > 1 && points[i - 2].value === point.value)),
      )
    )
      return `the points of ${name} do not ascend`;
  }
  return undefined;
}

/** @param {Uint8Array} bytes @param {string} name of the package, for messages @returns {Promise<Manifest>} */
export async function decodeManifest(bytes, name) {
  /** @type {(code: string, fields: Record<string, unknown>) => Promise<never>} */
  const refuse = async (code, fields) => {
    await import("./messages.js");
    throw new VolpkgError(code, { path: name, ...fields });
  };
  /** @type {any} */
  let record;
  try {
    record = parseJson(bytes);
  } catch (error) {
    // Servers of single-page apps answer so for every address that they do not know.
    const found = bytes[0] === 0x3c ? "the server answers with a web page" : /** @type {Error} */ (error).message;
    await refuse("VP4002", { problem: `manifest.json is not JSON: ${found}` });
  }
  if (record?.format !== "volpkg") await refuse("VP4002", { problem: 'manifest.json does not say "format": "volpkg"' });
  const { version, extensions_required: required } = record;
  if (!text(version) || !/^(?!0\d)\d{1,4}\.(?!0\d)\d{1,4}$/.test(version))
    await refuse("VP4002", { problem: "manifest.json has no version of the form major.minor" });
  if (!version.startsWith("1.")) await refuse("VP4003", { version, known: "1.x" });
  if (Array.isArray(required) && required.length) await refuse("VP4070", { extensions: required });
  const problem = schemaBreach(record, "Manifest", "") ?? recordBreach(record);
  if (problem) await refuse("VP4004", { problems: problem });
  if (record.state === "draft") await refuse("VP4005", {});
  const manifest = completed(record);
  if (manifest.textures.some(({ format }) => !has(INTERNAL, format))) await import("../gl/blocks.js");
  for (const texture of manifest.textures)
    texture.gl = uploadOf(texture.format, texture.dimension, manifest.profile.api);
  const contradiction = contradictions(manifest, usesOf(manifest)).next().value ?? contradictionOf(manifest);
  if (contradiction) await refuse("VP4011", { problem: contradiction });
  return manifest;
}

/** The same manifest without values that are null, and with lists and a name that are absent. @param {any} record @returns {Manifest} */
function completed(record) {
  const manifest = JSON.parse(JSON.stringify(record, (_, value) => value ?? undefined));
  for (const list of ["channels", "textures", "programs", "pictures", "files"]) manifest[list] ??= [];
  for (const picture of manifest.pictures) picture.drawings ??= [];
  if (manifest.segments) manifest.segments.name ??= "segments";
  for (const channel of manifest.channels) for (const list of ["levels", "transfer_functions"]) channel[list] ??= [];
  return manifest;
}

/** @param {Manifest} manifest @param {Use[]} more what parts use @returns {Generator<string, void>} */
export function* contradictions(manifest, more) {
  const { files, profile, channels, programs, pictures, preview } = manifest;
  // Textures of other roles are of a later version; no program reads them.
  const textures = manifest.textures.filter(({ role }) => ROLES.includes(role));
  const functions = channels.flatMap((channel) => channel.transfer_functions);
  const roles = new Map(files.map((file) => [file.path, file.role]));
  const named = { files, textures: manifest.textures, programs, channels, functions, pictures };
  for (const [what, list] of Object.entries(named)) {
    if (new Set(list.map((/** @type {any} */ each) => each.path ?? each.name)).size < list.length)
      yield `two ${what} have one name`;
  }
  if (/** @type {any} */ (manifest).stages?.length) yield "it is sealed, but has records of stages";
  if (!manifest.grid || !manifest.render) yield "it is sealed without grid or render";
  if (!channels.length || !textures.length || !pictures.length || (!programs.length && profile.api !== "es1.1"))
    yield "it is sealed without channels, textures, pictures or programs";
  for (const { name, drawings, pieces, on_demand: bricks } of pictures) {
    if (!drawings.length) yield `picture ${name} has no drawing`;
    if (pieces && !manifest.subvolumes) yield `picture ${name} has pieces, the package no sub-volumes`;
    if (bricks && !manifest.on_demand) yield `picture ${name} is drawn on demand, the package has no bricks`;
  }
  const uses = [
    ...textures.map((each) => [each.file, "texture"]),
    ...shadersOf(programs),
    ...(preview ? [[preview, "preview"]] : []),
    ...more,
  ];
  for (const [file, role] of uses)
    if (roles.get(file) !== role)
      yield `${file} is used as ${role}, but is ${roles.get(file) ?? "not among the files"}`;
  for (const each of textures) {
    // The extension of ASTC also has its sRGB blocks.
    const names = [each.format, ...(each.format === "astc-4x4-unorm-srgb" ? ["astc-4x4-unorm"] : [])];
    if (!each.gl.internal_format || !names.some((name) => profile.texture_formats.includes(name)))
      yield `texture ${each.name} has no format of the profile`;
    if (each.dimension === "2d" && each.shape_zyx[0] !== 1)
      yield `texture ${each.name} is 2D, but has ${each.shape_zyx[0]} slices`;
  }
  for (const { name, quantization, levels, transfer_functions } of channels) {
    if (!quantization || !levels.length || !transfer_functions.length)
      yield `channel ${name} has no quantization, no levels or no transfer functions`;
    if (quantization.window[0] >= quantization.window[1]) yield `channel ${name} has an empty window`;
  }
}
