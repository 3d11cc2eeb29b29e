/** From what is wanted to what draws: textures, program and mesh of a picture at a level. */
import { choose, textureOf } from "./choose.js";
import { checkFits } from "./device.js";
import { VolpkgError } from "./error.js";
import { isWebGl2 } from "./formats.js";
import { formsOf } from "./forms.js";
import { checkNamed, checkUniforms, setUniform } from "./program.js";
import { passesOf } from "./shapes.js";

/** @typedef {import("./choose.js").Choice} Choice */
/** @typedef {import("./choose.js").Value} Value */
/** @typedef {import("./clip.js").Behind} Behind */
/** @typedef {import("./clip.js").Clip} Clip */
/** @typedef {import("./device.js").Device} Device */
/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {import("./mesh.js").Mesh} Mesh */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("./program.js").Linked} Linked */
/** @typedef {import("./techniques.js").Technique} Technique */
/** @typedef {import("./textures.js").Made} Made */
/** @typedef {import("./types.js").TransferFunction} TransferFunction */
/**
 * What is to be drawn, and how the context is used.
 * @typedef {object} Wanted
 * @property {Gl} gl
 * @property {Package} pack
 * @property {Device} device
 * @property {string} picture
 * @property {number} level
 * @property {number | null} point
 * @property {Map<string, TransferFunction>} edits
 * @property {Clip | null} clip
 * @property {number} [limit] of the bytes of all textures
 * @property {import("./draco.js").DecodeDraco} [decodeDraco]
 * @property {(work: () => void) => void} use called with each use of the context
 * @property {AbortSignal} signal
 * @property {Made[]} held gets each texture as soon as it is there
 */
/** What a program or a pass reads. @typedef {Pick<import("./types.js").Program, "uniforms" | "samplers" | "before" | "light_pass">} Inputs */
/** What draws, all of it on the GPU. @typedef {{choice: Choice, linked: Linked, technique: Technique | null, textures: Made[], mesh: Mesh | null, clip: Clip | null, notes: string[], lightOf: typeof import("./light.js").lightOf | null}} Drawn */

/** Techniques that draw one triangle. Tiles, too, make the same picture at once. */
const ONE_TRIANGLE = ["ray-casting", "tiles"];

/** @param {Wanted} wanted @returns {Promise<Drawn>} */
export async function load(wanted) {
  const { gl, pack, device, point, edits, clip, limit, use, signal, held } = wanted;
  let choice = point === null ? choose(pack, wanted.picture, wanted.level) : await (await import("./subvolumes.js")).chooseBlock(pack, wanted.picture, point, textureOf, signal);
  checkFits(gl, pack, choice, limit);
  if (edits.size) choice = await (await import("./edit.js")).edited(pack, choice, edits, signal);
  signal.throwIfAborted();
  const forms = await formsOf(device.probes, (wants) => use(() => device.probes.test(wants)), choice.textures);
  // Shaders come and compile while textures come.
  const linking = linkedFor(wanted, choice);
  linking.catch(() => {});
  const textures = [];
  for (const [i, texture] of choice.textures.entries()) {
    const made = await device.textures.get(texture, forms[i], choice.texels[texture.name], signal, use);
    held.push(made);
    textures.push(made);
  }
  const linked = await linking;
  const isPlain = ONE_TRIANGLE.includes(choice.program.technique ?? "ray-casting") && !passesOf(choice.program).length;
  const technique = isPlain ? null : await (await import("./techniques.js")).loadTechnique(wanted, choice, checkNamed);
  const notes = [...new Set(forms.flatMap(({ note }, i) => (note ? [`${choice.textures[i].name}: ${note}`] : [])))];
  const mesh = pack.manifest.proxy && point === null ? await (await import("./mesh.js")).loadMesh(wanted, choice, notes) : null;
  const lightOf = choice.program.uniforms.some(({ source }) => source === "light_mm") ? (await import("./light.js")).lightOf : null;
  return { choice, linked, technique, textures, mesh, clip, notes, lightOf };
}

/** @param {Wanted} wanted @param {Choice} choice */
async function linkedFor({ gl, pack, device, clip, signal }, { program, textures }) {
  const [vertex, fragment] = await Promise.all([program.vertex, program.fragment].map((path) => pack.text(path, { signal })));
  const paths = /** @type {[string, string]} */ ([program.vertex, program.fragment]);
  const texts = { name: program.name, vertex, fragment: clip?.shader(fragment, program.fragment) ?? fragment, paths };
  const linked = await device.linked(`${program.name} ${clip?.planes.length ?? 0} ${clip?.depth ?? false}`, texts);
  checkUniforms(gl, linked, program, textures, clip?.uniforms ?? []);
  return linked;
}

/**
 * Gives a program everything that it reads.
 * @param {Gl} gl @param {Drawn} drawn @param {Linked} linked @param {Inputs} program
 * @param {Record<string, Value>} values by the source of a uniform @param {Behind | null} behind
 */
export function bind(gl, { choice, textures, clip }, linked, program, values, behind) {
  gl.useProgram(linked.handle);
  for (const { name, source } of program.uniforms) {
    if (values[source] === undefined) throw new VolpkgError("VP4011", { path: choice.program.name, problem: `it has no value for ${name}` });
    setUniform(gl, linked.locations[name], values[source]);
  }
  clip?.bind(gl, linked, program.samplers.length + passesOf(program).length, behind);
  program.samplers.forEach(({ name }, unit) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(textures[unit].target, textures[unit].handle);
    if (isWebGl2(gl)) gl.bindSampler(unit, null);
    gl.uniform1i(linked.locations[name], unit);
  });
}
