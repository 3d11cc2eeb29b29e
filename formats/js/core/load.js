/** Loads the textures, program and mesh of a picture at a level. */
import { check, either } from "./abort.js";
import { choose, namedBy } from "./drawing.js";
import { checkFits } from "../gl/device.js";
import { VolpkgError } from "./error.js";
import { isWebGl2 } from "../gl/formats.js";
import { formsOf } from "../gl/forms.js";
import { checkNamed, checkUniforms, setUniform } from "../gl/program.js";
import { passesOf } from "./shapes.js";

/** @typedef {import("./drawing.js").Choice} Choice */
/** @typedef {import("./drawing.js").Value} Value */
/** @typedef {import("../draw/clip.js").Behind} Behind */
/** @typedef {import("../draw/clip.js").Clip} Clip */
/** @typedef {import("../gl/device.js").Device} Device */
/** @typedef {import("../gl/formats.js").Gl} Gl */
/** @typedef {import("../gl/mesh.js").Mesh} Mesh */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("../gl/program.js").Linked} Linked */
/** @typedef {import("../draw/techniques.js").Technique} Technique */
/** @typedef {import("../gl/textures.js").Made} Made */
/** @typedef {import("./types.js").TransferFunction} TransferFunction */
/**
 * A request for a picture, and how to use the context.
 * @typedef {object} Wanted
 * @property {Gl} gl
 * @property {Package} pack
 * @property {Device} device
 * @property {string} picture
 * @property {number} level
 * @property {number | null} point
 * @property {number} frame
 * @property {Map<string, import("../edit/edit.js").Edit>} edits
 * @property {import("../draw/segments.js").Segments | null} segments as an app has changed them
 * @property {Clip | null} clip
 * @property {number} [maxTextureBytes] limit of the bytes of all textures
 * @property {import("../draco.js").DecodeDraco} [decodeDraco]
 * @property {(work: () => void) => void} use called with each use of the context
 * @property {AbortSignal} signal
 * @property {Made[]} held gets each texture as soon as it exists
 */
/**
 * Inputs of a program or a pass.
 * @typedef {Pick<import("./types.js").Program, "uniforms" | "samplers" | "before" | "light_pass">} Inputs
 */
/**
 * Everything on the GPU that draws a picture.
 * @typedef {object} Drawn
 * @property {Choice} choice
 * @property {Linked} linked
 * @property {Technique | null} technique
 * @property {Made[]} textures
 * @property {Mesh | null} mesh
 * @property {Clip | null} clip
 * @property {string[]} notes
 * @property {typeof import("../draw/light.js").lightOf | null} lightOf
 */

/** Techniques that draw one triangle. Tiles, too, make the same picture at once. */
const ONE_TRIANGLE = ["ray-casting", "ray-casting-as-published", "tiles"];

/** @param {Wanted} wanted @returns {Promise<Drawn>} */
export async function load(wanted) {
  const { gl, pack, device, edits, segments, clip, maxTextureBytes, use, signal } = wanted;
  let choice = await chosen(wanted);
  checkFits(gl, pack, choice, maxTextureBytes);
  choice = clip?.lit?.of(choice) ?? choice;
  if (edits.size) choice = await (await import("../edit/edit.js")).edited(pack, choice, edits, signal);
  if (segments) choice = await segments.shown(pack, choice, signal);
  check(signal);
  const { program, textures: all } = choice;
  const forms = await formsOf(device.probes, (wants) => use(() => device.probes.test(wants)), all);
  const notes = [...new Set(forms.flatMap(({ note }, i) => (note ? [`${all[i].name}: ${note}`] : [])))];
  const isPlain = ONE_TRIANGLE.includes(program.technique ?? "ray-casting") && !passesOf(program).length;
  const hasMesh = pack.manifest.proxy && wanted.point === null;
  const isLit = program.uniforms.some(({ source }) => ["light_mm", "environment"].includes(source));
  // Everything comes together, and shaders compile meanwhile.
  const coming = Promise.all([
    linkedFor(wanted, choice),
    isPlain
      ? null
      : import("../draw/techniques.js").then(({ loadTechnique }) => loadTechnique(wanted, choice, checkNamed)),
    hasMesh ? import("../gl/mesh.js").then(({ loadMesh }) => loadMesh(wanted, choice, notes, checkNamed)) : null,
    isLit ? import("../draw/light.js") : null,
  ]);
  const parts = await settled(coming, texturesFor(wanted, choice, forms));
  const [[linked, technique, mesh, light], textures] = parts;
  return { choice, linked, technique, textures, mesh, clip, notes, lightOf: light?.lightOf ?? null };
}

/** @param {Wanted} wanted @returns {Promise<Choice>} */
async function chosen({ pack, picture, level, point, frame, signal }) {
  if (point === null) return choose(pack, picture, level, frame);
  return (await import("./subvolumes.js")).chooseBlock(pack, picture, point, namedBy, signal);
}

/**
 * Waits for two promises and returns both results. Throws an error only after both have ended.
 * @template One, Other @param {Promise<One>} one @param {Promise<Other>} other @returns {Promise<[One, Other]>}
 */
async function settled(one, other) {
  await Promise.allSettled([one, other]);
  return [await one, await other];
}

/**
 * All textures of a choice, each file once.
 * @param {Wanted} wanted @param {Choice} choice @param {import("../gl/textures.js").Form[]} forms
 */
async function texturesFor({ device, use, signal, held }, { textures, texels }, forms) {
  const together = either(signal);
  /** @type {Map<unknown, Promise<Made>>} */
  const coming = new Map();
  textures.forEach((texture, i) => {
    const key = texels[texture.name] ?? texture.file;
    if (coming.has(key)) return;
    const made = device.textures.get(texture, forms[i], texels[texture.name], together.signal, use);
    coming.set(key, made);
    made.then(
      (value) => held.push(value),
      () => together.abort(),
    );
  });
  // The first failure ends the others, which then fail as well.
  const first = Promise.all(coming.values());
  first.catch(() => {});
  await Promise.allSettled(coming.values());
  await first;
  together.abort();
  return Promise.all(
    textures.map((texture) => /** @type {Promise<Made>} */ (coming.get(texels[texture.name] ?? texture.file))),
  );
}

/** @param {Wanted} wanted @param {Choice} choice */
async function linkedFor({ gl, pack, device, clip, signal }, { program, textures }) {
  const paths = /** @type {[string, string]} */ ([program.vertex, program.fragment]);
  const linked = await device.linked(`${program.name} ${clip?.key ?? ""}`, async () => {
    const [vertex, fragment] = await Promise.all(paths.map((path) => pack.text(path, { signal })));
    return { name: program.name, vertex, fragment: clip?.shader(fragment, program.fragment) ?? fragment, paths };
  });
  checkUniforms(gl, linked, program, textures, clip?.uniforms ?? []);
  return linked;
}

/**
 * Gives a program everything that it reads.
 * @param {Gl} gl @param {Drawn} drawn @param {Linked} linked @param {Inputs} program
 * @param {Record<string, Value>} values by the source of a uniform @param {Behind} behind
 */
export function bind(gl, { choice, textures, clip }, linked, program, values, behind) {
  gl.useProgram(linked.handle);
  for (const { name, source } of program.uniforms) {
    if (values[source] === undefined)
      throw new VolpkgError("VP4011", { path: choice.program.name, problem: `it has no value for ${name}` });
    setUniform(gl, linked.locations[name], values[source]);
  }
  clip?.bind(gl, linked, program.samplers.length + passesOf(program).length, behind);
  program.samplers.forEach((name, unit) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(textures[unit].target, textures[unit].handle);
    if (isWebGl2(gl)) gl.bindSampler(unit, null);
    gl.uniform1i(linked.locations[name], unit);
  });
}
