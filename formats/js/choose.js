/** A drawing: the program of a picture and a level, and the inputs of its samplers and uniforms. SPEC section 9. */
import { VolpkgError } from "./error.js";
import { texelBytes } from "./ktx2.js";
import { FORMATS } from "./formats.js";
import { has } from "./shapes.js";

/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("./types.js").Manifest} Manifest */
/** @typedef {import("./types.js").Program} Program */
/** @typedef {import("./types.js").Texture} Texture */
/** @typedef {import("./types.js").Sampler} Sampler */
/** @typedef {import("./types.js").Level} Level */
/** @typedef {number | readonly number[]} Value */

/**
 * A program with all that it reads.
 * @typedef {object} Choice
 * @property {Program} program
 * @property {Level} level
 * @property {Texture[]} textures in the order of the program's samplers
 * @property {Record<string, Value>} values of uniforms that are the same in all pictures, by the source of the uniform
 * @property {boolean} [relit] whether light was computed again for an edited function
 * @property {Record<string, Uint8Array>} texels that are not read from the package, by the name of their texture
 */

/**
 * @param {Package} pack
 * @param {string} picture name of a transfer function, or of a picture of several
 * @param {number} index of a level
 * @returns {Choice}
 */
export function choose(pack, picture, index) {
  const { manifest } = pack;
  const program = manifest.programs.find((each) => each.transfer === picture && each.levels.includes(index));
  const channel = program && channelOf(manifest, program);
  const level = channel?.levels.find((each) => each.index === index);
  if (!program || !level) throw nothing(pack, picture, `level ${index}`);
  const textures = program.samplers.map((sampler) => textureOf(pack, program, sampler, index));
  const table = manifest.skipping?.tables?.find((each) => each.transfer === program.transfer && each.level === index);
  return {
    program,
    level,
    textures,
    values: {
      texture_from_box: level.texture_from_box_per_mm_xyz,
      blocks_from_box: table?.blocks_from_box_per_mm_xyz ?? [0, 0, 0],
      mipmap: textures.find((each) => each.mipmap !== undefined)?.mipmap ?? 0,
    },
    // A texture may be called __proto__.
    texels: Object.create(null),
  };
}

/** Distance of samples that a package asks for at a level. @param {Manifest} manifest @param {number} level */
export function stepOf({ render }, level) {
  return render.level_steps?.find((each) => each.level === level)?.step_mm ?? render.step_mm;
}

/** @param {Package} pack @param {string} transfer @param {string} level for people */
export function nothing(pack, transfer, level) {
  const known = pack.programs.map(({ name, levels }) => `level ${levels.join(", ")} with ${name}`).join("; ");
  return new VolpkgError("VP5018", { package: pack.name, level, transfer, known: known || "nothing" });
}

/**
 * The channel whose levels a program draws: of a picture of several channels, that of any of them.
 * @param {Manifest} manifest @param {Program} program
 */
function channelOf(manifest, program) {
  const { together, segments, channels } = manifest;
  const joint = [together, segments].find((each) => each?.name === program.transfer);
  const transfer = joint ? joint.transfers[0] : program.transfer;
  return channels.find((each) => each.transfer_functions.some(({ name }) => name === transfer));
}

/** @param {Package} pack @param {Program} program @param {Sampler} sampler @param {number} level @returns {Texture} */
export function textureOf(pack, program, sampler, level) {
  const { manifest } = pack;
  const transfer = sampler.transfer ?? program.transfer;
  const channel = manifest.channels.find((each) => each.transfer_functions.some(({ name }) => name === transfer));
  let found = manifest.textures.filter(
    (each) =>
      each.role === sampler.role &&
      (each.part ?? 0) === (sampler.part ?? 0) &&
      (each.level === undefined || each.level === level) &&
      (each.transfer === undefined || each.transfer === transfer) &&
      // Light of a cut volume comes in its place later.
      !each.light?.planes?.length &&
      (!each.channels?.length || !channel || each.channels.includes(channel.name)),
  );
  // A level's own table replaces the common one.
  const own = found.filter((each) => each.level === level);
  if (own.length) found = own;
  if (found.length !== 1) {
    const problem = `program ${program.name} needs one texture ${sampler.role} for ${transfer} at level ${level}, and the package has ${found.length}`;
    throw new VolpkgError("VP4011", { path: pack.name, problem });
  }
  return found[0];
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

/**
 * Bytes that the textures of a choice take on the GPU.
 * @param {Manifest} manifest @param {Choice} choice
 */
export function bytesOf(manifest, choice) {
  const files = new Map(choice.textures.map((each) => [each.file, each]));
  const all = [...files.values()].flatMap((each) => sharing(manifest, each));
  return all.reduce((sum, each) => sum + texelBytes(checkedFormat(each), each.shape_zyx), 0);
}

/**
 * The internal format of a texture, checked to be one that WebGL accepts.
 * @param {Texture} texture
 */
export function checkedFormat(texture) {
  const { internal_format: internal, format, type } = texture.gl;
  const known = has(FORMATS, internal) ? FORMATS[internal] : undefined;
  if (!known || known.format !== format || (format && known.type !== type)) {
    throw new VolpkgError("VP4030", {
      name: texture.file,
      problem: `the manifest gives it the format ${[internal, format, type].join("/")}`,
    });
  }
  return internal;
}
