/**
 * Proxy geometry (spec/proxy.md): rays begin and end at a mesh around the visible part of the volume. A mesh compressed
 * with Draco needs a decoder from the app, because a decoder is larger than this whole library. Without one the mesh is not
 * used, a note reports it, and rays begin at the box; the picture is the same.
 */
import { check } from "../core/abort.js";
import { invert } from "../camera.js";
import { VolpkgError } from "../core/messages.js";
import { isWebGl2 } from "./formats.js";

/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {import("./program.js").Linked} Linked */
/** @typedef {{positions: Float32Array, indices: Uint16Array}} Part */

const LARGEST_JSON = 1 << 20;
/** Units of a mesh in a voxel. */
const UNITS = 4;

/**
 * The mesh of a choice, or null if rays begin at the box.
 * @param {import("../core/load.js").Wanted} wanted @param {import("../core/drawing.js").Choice} choice
 * @param {string[]} notes gets a note if the mesh cannot be used
 * @param {typeof import("./program.js").checkNamed} checkNamed
 */
export async function loadMesh(wanted, { drawing, level, textures }, notes, checkNamed) {
  const { gl, pack, device, decodeDraco, use, signal } = wanted;
  const { proxy, programs, grid } = pack.manifest;
  const record = proxy?.meshes?.find((mesh) => mesh.name === drawing?.at_mesh?.mesh);
  const program = programs.find((program) => program.name === drawing?.at_mesh?.program);
  if (!record || !program) return null;
  if (record.draco && !decodeDraco) {
    notes.push(new VolpkgError("VP7064", { file: record.file }).message);
    return null;
  }
  const parts = record.file
    ? await partsOf(
        await pack.read(record.file, { signal }),
        record.file,
        record.triangles ?? 0,
        record.draco ? decodeDraco : undefined,
      )
    : [];
  const paths = /** @type {[string, string]} */ ([program.vertex, program.fragment]);
  const linked = await device.linked(program.name, async () => {
    const [vertex, fragment] = await Promise.all(paths.map((path) => pack.text(path, { signal })));
    return { name: program.name, vertex, fragment, paths };
  });
  check(signal);
  /** @type {Shape | null} */
  let made = null;
  use(() => (made = new Shape(gl, parts)));
  const shape = /** @type {Shape | null} */ (made);
  if (!shape) return null;
  try {
    const { loadTechnique } = await import("../draw/techniques.js");
    // An app that cuts the volume draws without the mesh.
    const technique = await loadTechnique({ ...wanted, clip: null }, { program, textures, level }, checkNamed, shape);
    return technique && new Mesh(shape, linked, technique, record.box_from_mesh_mm_xyz, grid.extent_mm_zyx);
  } catch (error) {
    use(() => shape.dispose());
    throw error;
  }
}

/** The faces of a mesh on the GPU. */
export class Shape {
  #gl;
  #array;
  /** @type {{vertices: WebGLBuffer | null, indices: WebGLBuffer | null, count: number}[]} */
  #parts;

  /** @param {Gl} gl @param {Part[]} parts */
  constructor(gl, parts) {
    this.#gl = gl;
    this.#array = isWebGl2(gl) ? gl.createVertexArray() : null;
    if (isWebGl2(gl)) gl.bindVertexArray(this.#array);
    this.#parts = parts.map(({ positions, indices }) => {
      const made = { vertices: gl.createBuffer(), indices: gl.createBuffer(), count: indices.length };
      gl.bindBuffer(gl.ARRAY_BUFFER, made.vertices);
      gl.bufferData(gl.ARRAY_BUFFER, positions, gl.STATIC_DRAW);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, made.indices);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
      return made;
    });
    if (isWebGl2(gl)) gl.bindVertexArray(null);
  }

  /** Draws the nearest faces into red and green of the bound target, and the farthest into blue and alpha. */
  draw() {
    const gl = this.#gl;
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    if (isWebGl2(gl)) gl.bindVertexArray(this.#array);
    for (const near of [true, false]) {
      gl.colorMask(near, near, !near, !near);
      gl.clearDepth(near ? 1 : 0);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.depthFunc(near ? gl.LESS : gl.GREATER);
      for (const { vertices, indices, count } of this.#parts) {
        gl.bindBuffer(gl.ARRAY_BUFFER, vertices);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
        gl.enableVertexAttribArray(0);
        gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
        gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_SHORT, 0);
      }
    }
    gl.colorMask(true, true, true, true);
    gl.clearDepth(1);
    gl.depthFunc(gl.LESS);
    gl.disable(gl.DEPTH_TEST);
  }

  dispose() {
    const gl = this.#gl;
    for (const { vertices, indices } of this.#parts) {
      gl.deleteBuffer(vertices);
      gl.deleteBuffer(indices);
    }
    if (isWebGl2(gl)) gl.deleteVertexArray(this.#array);
  }
}

/** A mesh, and the program that draws with it. */
export class Mesh {
  #shape;
  #ends;

  /**
   * @param {Shape} shape @param {Linked} linked @param {import("../draw/techniques.js").Technique} technique
   * @param {readonly number[]} scale @param {readonly number[]} extent z, y, x
   */
  constructor(shape, linked, technique, scale, extent) {
    this.#shape = shape;
    this.linked = linked;
    this.technique = technique;
    /** Values of uniforms, by their source. */
    this.values = { box_from_mesh: scale };
    // The last voxel of a coarse level may reach beyond the extent, and the shader moves the border a voxel outwards.
    this.#ends = [0, 1, 2].map((axis) => [-UNITS * scale[axis], extent[2 - axis] + 2 * UNITS * scale[axis]]);
  }

  /**
   * Itself, for a camera in front of it; null if the near or the far plane cuts it, or the eye is within the volume.
   * @param {ArrayLike<number>} boxFromClip
   */
  front(boxFromClip) {
    const sign = boxFromClip[15] < 0 ? -1 : 1;
    const clipFromBox = invert(boxFromClip).map((x) => sign * x);
    const [x, y, z] = this.#ends;
    for (let corner = 0; corner < 8; corner++) {
      const at = [x[corner & 1], y[(corner >> 1) & 1], z[corner >> 2], 1];
      const [depth, w] = [2, 3].map((row) =>
        at.reduce((sum, each, column) => sum + each * clipFromBox[4 * column + row], 0),
      );
      if (Math.abs(depth) > w) return null;
    }
    return this;
  }

  dispose() {
    this.technique.dispose();
    this.#shape.dispose();
  }
}

/**
 * The primitives of a glTF binary of the kind in spec/proxy.md.
 * @param {Uint8Array<ArrayBuffer>} data @param {string} name @param {number} triangles how many it must have
 * @param {import("../draco.js").DecodeDraco} [decodeDraco] of a file that is compressed
 * @returns {Promise<Part[]>}
 */
export async function partsOf(data, name, triangles, decodeDraco) {
  /** @param {string} problem @returns {never} */
  const refuse = (problem) => {
    throw new VolpkgError("VP4039", { name, problem });
  };
  const view = new DataView(data.buffer, data.byteOffset, data.length);
  const words = (/** @type {number[]} */ ...at) =>
    at.map((value) => (value + 4 <= data.length ? view.getUint32(value, true) : -1));
  const [magic, version, length, size, kind] = words(0, 4, 8, 12, 16);
  if (
    magic !== 0x46546c67 ||
    version !== 2 ||
    length !== data.length ||
    kind !== 0x4e4f534a ||
    size > LARGEST_JSON ||
    20 + size > length
  )
    refuse("it is no glTF binary");
  const [binarySize, binaryKind] = words(20 + size, 24 + size);
  const start = 28 + size;
  if (binaryKind !== 0x004e4942 || start + binarySize !== length) refuse("it has no binary chunk that ends with it");
  /** @type {any} */
  let gltf;
  try {
    gltf = JSON.parse(new TextDecoder().decode(data.subarray(20, 20 + size)));
  } catch (error) {
    refuse(`its JSON cannot be read: ${/** @type {Error} */ (error).message}`);
  }
  /** @param {number} view @returns {[from: number, bytes: number]} */
  const viewOf = (view) => {
    const { byteOffset: at = 0, byteLength } = gltf?.bufferViews?.[view] ?? {};
    if (![at, byteLength].every((value) => Number.isSafeInteger(value) && value >= 0) || at + byteLength > binarySize)
      refuse(`buffer view ${view} reaches beyond the file`);
    return [data.byteOffset + start + at, byteLength];
  };
  /** @param {any} index @param {number} type @param {string} shape @param {number} bytes */
  const read = (index, type, shape, bytes) => {
    const { bufferView, componentType, type: found, count, byteOffset = 0 } = gltf?.accessors?.[index] ?? {};
    if (
      componentType !== type ||
      found !== shape ||
      ![count, byteOffset].every((value) => Number.isSafeInteger(value) && value >= 0)
    )
      refuse(`accessor ${index} is not of the kind that packages have`);
    const [from, byteLength] = viewOf(bufferView);
    if (byteOffset + count * bytes > byteLength) refuse(`accessor ${index} reaches beyond its bytes`);
    return data.buffer.slice(from + byteOffset, from + byteOffset + count * bytes);
  };
  const unpack = decodeDraco && (await import("../draco.js")).unpackedPart;
  const parts = /** @type {Part[]} */ ([]);
  for (const each of Array.isArray(gltf?.meshes?.[0]?.primitives) ? gltf.meshes[0].primitives : []) {
    if ((each?.mode ?? 4) !== 4) refuse("it has primitives other than triangles");
    const [from, bytes] = decodeDraco ? viewOf(each?.extensions?.KHR_draco_mesh_compression?.bufferView) : [0, 0];
    const part =
      unpack && decodeDraco
        ? await unpack(new Uint8Array(data.buffer.slice(from, from + bytes)), decodeDraco, name)
        : {
            positions: new Float32Array(read(each?.attributes?.POSITION, 5126, "VEC3", 12)),
            indices: new Uint16Array(read(each?.indices, 5123, "SCALAR", 2)),
          };
    const { positions, indices } = part;
    if (
      !positions.every(Number.isFinite) ||
      indices.length % 3 ||
      indices.some((index) => 3 * index >= positions.length)
    )
      refuse("an index names no vertex, or a position is NaN or infinite");
    parts.push(part);
  }
  const found = parts.reduce((sum, { indices }) => sum + indices.length / 3, 0);
  if (!parts.length || found !== triangles) refuse(`it has ${found} triangles instead of ${triangles}`);
  return parts;
}
