/** Meshes that are compressed with Draco, for apps that bring a decoder. spec/proxy.md. */
import { VolpkgError } from "./core/messages.js";

/**
 * Result of a Draco decoder: x, y, z of each vertex, and three vertices of each triangle.
 * @typedef {{positions: ArrayLike<number>, indices: ArrayLike<number>}} Decoded
 */
/** @typedef {(bytes: Uint8Array<ArrayBuffer>) => Decoded | Promise<Decoded>} DecodeDraco */

/** "DRACO", version 2.2, a triangle mesh by edgebreaker, no metadata; a byte that says how triangles follow each other is next. */
const START = [0x44, 0x52, 0x41, 0x43, 0x4f, 2, 2, 1, 1, 0, 0];
const MOST_VERTICES = 65535;
/** A closed surface has about two triangles for each vertex, and four where it is full of holes. */
const MOST_TRIANGLES = 8 * MOST_VERTICES;

/**
 * Makes a function for the renderer's option `decodeDraco` from the npm package draco3d.
 * @param {any} module result of `createDecoderModule` of draco3d
 * @returns {DecodeDraco}
 */
export function dracoDecoder(module) {
  return (bytes) => {
    const [decoder, mesh, values] = [new module.Decoder(), new module.Mesh(), new module.DracoFloat32Array()];
    let at = 0;
    try {
      const status = decoder.DecodeArrayToMesh(bytes, bytes.length, mesh);
      if (!status.ok()) throw new Error(status.error_msg());
      decoder.GetAttributeFloatForAllPoints(mesh, decoder.GetAttributeByUniqueId(mesh, 0), values);
      const positions = Float32Array.from({ length: values.size() }, (_, i) => values.GetValue(i));
      const size = 12 * mesh.num_faces();
      at = module._malloc(size);
      decoder.GetTrianglesUInt32Array(mesh, size, at);
      return { positions, indices: new Uint32Array(module.HEAPF32.buffer, at, size / 4).slice() };
    } finally {
      module._free(at);
      for (const held of [values, mesh, decoder]) module.destroy(held);
    }
  };
}

/**
 * A primitive from its bitstream, whose sizes are looked at first: a few bytes that say 2^28 triangles keep a decoder busy for
 * minutes.
 * @param {Uint8Array<ArrayBuffer>} bytes @param {DecodeDraco} decode @param {string} name of the file
 * @returns {Promise<import("./gl/mesh.js").Part>}
 */
export async function unpackedPart(bytes, decode, name) {
  /** @param {string} problem @returns {never} */
  const refuse = (problem) => {
    throw new VolpkgError("VP4039", { name, problem: `Draco: ${problem}` });
  };
  if (START.some((byte, i) => bytes[i] !== byte)) refuse("it is not a triangle mesh of version 2.2 by edgebreaker");
  const [vertices, at] = varint(bytes, START.length + 1);
  const [triangles] = varint(bytes, at);
  if (vertices > MOST_VERTICES || triangles > MOST_TRIANGLES)
    refuse(`it says ${vertices} vertices and ${triangles} triangles, more than a primitive has`);
  /** @type {Decoded | undefined} */
  let found;
  try {
    found = await decode(bytes);
  } catch (error) {
    refuse(String(error));
  }
  const { positions, indices } = /** @type {Decoded} */ (found);
  if (!indices.length || positions.length > 3 * MOST_VERTICES) refuse("indices are missing or need more than 16 bits");
  // The decoder gives the whole numbers up to the rounding of float32.
  return { positions: Float32Array.from(positions, Math.round), indices: Uint16Array.from(indices) };
}

/** A number of seven bits in each byte, and where the next begins. @param {Uint8Array} bytes @param {number} at @returns {[number, number]} */
function varint(bytes, at) {
  let number = 0;
  for (let i = 0; i < 5; i++) {
    const byte = bytes[at + i] ?? 255;
    number += (byte & 127) * 2 ** (7 * i);
    if (byte < 128) return [number, at + i + 1];
  }
  return [Infinity, at];
}
