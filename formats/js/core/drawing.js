/** A drawing: the program of a picture and a level, and the inputs of its samplers and uniforms. spec/README.md. */
import { VolpkgError } from "./error.js";
import { texelBytes } from "../gl/ktx2.js";
import { FORMATS } from "../gl/formats.js";
import { has } from "./shapes.js";

/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("./types.js").Manifest} Manifest */
/** @typedef {import("./types.js").Program} Program */
/** @typedef {import("./types.js").Texture} Texture */
/** @typedef {import("./types.js").Level} Level */
/** @typedef {number | readonly number[]} Value */

/**
 * A drawing with all that it reads.
 * @typedef {object} Choice
 * @property {string} picture name of the picture
 * @property {import("./types.js").Drawing} [drawing] of a level
 * @property {Program} program
 * @property {Level} level
 * @property {number} stepMm nominal distance of samples
 * @property {Texture[]} textures in the order of the program's samplers
 * @property {Record<string, Value>} values of uniforms that are the same in all views, by the source of the uniform
 * @property {boolean} [relit] whether light was computed again for an edited function
 * @property {import("../on_demand.js").Bricks} [bricks] that are fetched as the view needs them
 * @property {Record<string, Uint8Array>} texels that are not read from the package, by the name of their texture
 */

/**
 * @param {Package} pack
 * @param {string} name of a picture
 * @param {number} index of a level
 * @param {number} frame
 * @returns {Choice}
 */
export function choose(pack, name, index, frame) {
  const { manifest } = pack;
  const picture = manifest.pictures.find((each) => each.name === name);
  const drawing = picture?.drawings.filter((each) => each.level === index)[frame];
  const channel = manifest.channels.find((each) => each.name === picture?.media[0].channel);
  const level = channel?.levels.find((each) => each.index === index);
  if (!drawing?.step_mm || !level) throw nothing(pack, name, `frame ${frame} of level ${index}`);
  const { program, textures } = namedBy(pack, drawing);
  const values = drawing.values.map(({ source, numbers }) => [source, numbers.length > 1 ? numbers : numbers[0]]);
  // A texture may be called __proto__.
  return {
    picture: name,
    drawing,
    program,
    level,
    stepMm: drawing.step_mm,
    textures,
    values: Object.fromEntries(values),
    texels: Object.create(null),
  };
}

/** @param {Package} pack @param {string} transfer @param {string} level for people */
export function nothing(pack, transfer, level) {
  const known = pack.programs.map(({ name, levels }) => `level ${levels.join(", ")} with ${name}`).join("; ");
  return new VolpkgError("VP5018", { package: pack.name, level, transfer, known: known || "nothing" });
}

/**
 * The program and the textures of a drawing, or of pieces.
 * @param {Package} pack @param {{program?: string, textures: string[]}} drawing
 * @param {(name: string) => Texture | undefined} [piece] textures that are not in the manifest
 */
export function namedBy({ name: path, manifest }, drawing, piece) {
  const program = manifest.programs.find(({ name }) => name === drawing.program);
  const textures = drawing.textures.flatMap(
    (name) => piece?.(name) ?? manifest.textures.find((each) => each.name === name) ?? [],
  );
  if (program?.samplers.length === textures.length) return { program, textures };
  const problem = `program ${drawing.program} reads ${program?.samplers.length} textures, and ${textures.length} are there`;
  throw new VolpkgError("VP4011", { path, problem });
}

/**
 * All textures that share the file of one, the finest first: itself, or the mipmaps.
 * @param {Manifest} manifest @param {Texture} texture
 */
export function sharing(manifest, texture) {
  if (texture.mipmap === undefined) return [texture];
  const found = manifest.textures.filter((each) => each.file === texture.file);
  return found.sort((a, b) => (a.mipmap ?? 0) - (b.mipmap ?? 0));
}

/** Bytes that the textures of a choice take on the GPU. @param {Manifest} manifest @param {Choice} choice */
export function bytesOf(manifest, choice) {
  const files = new Map(choice.textures.map((each) => [each.file, each]));
  const all = [...files.values()].flatMap((each) => sharing(manifest, each));
  return all.reduce((sum, each) => sum + texelBytes(checkedFormat(each), each.shape_zyx), 0);
}

/** The internal format of a texture, checked to be one that WebGL accepts. @param {Texture} texture */
export function checkedFormat(texture) {
  const internal = texture.gl.internal_format;
  if (!has(FORMATS, internal))
    throw new VolpkgError("VP4030", { name: texture.file, problem: `WebGL has no format ${texture.format}` });
  return internal;
}
