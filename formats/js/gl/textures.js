/** Textures: from a file that comes in pieces to the GPU, without ever holding more than a slab of it here. */
import { check } from "../core/abort.js";
import { sharing } from "../core/drawing.js";
import { VolpkgError } from "../core/error.js";
import { FORMATS, constant, finerSize, isWebGl2 } from "./formats.js";
import { HEAD_BYTES, readHead, texelBytes } from "./ktx2.js";
import { driverOf, forgetErrors } from "./program.js";

/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {import("../core/package.js").Package} Package */
/** @typedef {import("../core/types.js").Texture} Texture */
/** @typedef {import("./ktx2.js").Place} Place */
/**
 * How the texels of a file reach the device: as they are, or in another format.
 * @typedef {object} Form
 * @property {string} internal internal format of the texture
 * @property {string} [note] description of the loss
 * @property {(texels: Uint8Array, width: number) => ArrayBufferView} [convert] from rows of the file's texels
 * @property {number} [finer] of a table: texels for each entry, because the device does not filter
 */
/** @typedef {{handle: WebGLTexture, target: number, bytes: number}} Made */

/**
 * A level of a texture while it is filled.
 * @typedef {object} Level
 * @property {number} level
 * @property {Place} place
 * @property {number} unit bytes of a slice, or of a row of blocks
 * @property {Uint8Array} slab bytes not sent yet
 * @property {number} filled bytes of the slab
 * @property {number} at bytes that were sent
 * @property {import("../net/workers.js").Unpacker | null} frames unpacker of a packed texture
 */

const SLAB = 1 << 20;

/** The textures of a renderer. Each is uploaded once, whatever reads it. */
export class Textures {
  #gl;
  #pack;
  /** By file, or by the texels themselves where these were made here. @type {Map<unknown, Made>} */
  #made = new Map();
  /** Files come at the same time, but go to the GPU one piece after the other. @type {Promise<unknown>} */
  #turn = Promise.resolve();

  /** Bytes of textures that stay though nothing is drawn with them now. */
  spare = 0;

  /** @param {Gl} gl @param {Package} pack */
  constructor(gl, pack) {
    this.#gl = gl;
    this.#pack = pack;
  }

  /** Bytes on the GPU. */
  get bytes() {
    return [...this.#made.values()].reduce((sum, each) => sum + each.bytes, 0);
  }

  /**
   * @param {Texture} texture @param {Form} form
   * @param {Uint8Array | undefined} texels that replace the file's
   * @param {AbortSignal} signal
   * @param {(work: () => void) => void} use called with each use of the context
   * @returns {Promise<Made>}
   */
  async get(texture, form, texels, signal, use) {
    const key = texels ?? texture.file;
    const made = this.#made.get(key) ?? (await this.#make(texture, form, texels, signal, use));
    this.#made.set(key, made);
    return made;
  }

  /**
   * @param {Texture} texture
   * @param {Form} form
   * @param {Uint8Array | undefined} texels
   * @param {AbortSignal} signal
   * @param {(work: () => void) => void} use
   */
  async #make(texture, form, texels, signal, use) {
    const entries = texels ? [texture] : sharing(this.#pack.manifest, texture);
    const target = new Target(this.#gl, entries, form, use);
    try {
      if (texels) target.fill(texels);
      else await this.#load(target, entries, signal);
      await target.finish();
    } catch (error) {
      this.#gl.deleteTexture(target.made.handle);
      throw error;
    } finally {
      target.dispose();
    }
    return target.made;
  }

  /**
   * Frees every texture that is not among these, but for the oldest others of `spare` bytes: of frames that are played
   * again and again, the same ones are then always there.
   * @param {readonly Made[]} kept
   */
  keep(kept) {
    let { spare } = this;
    for (const [key, made] of this.#made) {
      if (kept.includes(made) || (spare -= made.bytes) >= 0) continue;
      this.#gl.deleteTexture(made.handle);
      this.#made.delete(key);
    }
  }

  /** @param {Target} target @param {Texture[]} entries @param {AbortSignal} signal */
  async #load(target, entries, signal) {
    const [{ file }] = entries;
    const size = this.#pack.size(file);
    const head = new Uint8Array(Math.min(HEAD_BYTES, size));
    let at = 0;
    for await (const piece of this.#pack.stream(file, { signal })) {
      if (at < head.length) {
        head.set(piece.subarray(0, head.length - at), at);
        if (at + piece.length >= head.length) {
          await target.begin(readHead(head, size, entries));
          target.take(head, 0);
        }
      }
      const rest = Math.max(head.length - at, 0);
      const part = rest < piece.length ? piece.subarray(rest) : null;
      const from = at + rest;
      at += piece.length;
      this.#turn = this.#turn
        .catch(() => {})
        .then(() => {
          if (part) target.take(part, from);
          return target.sent(signal);
        });
      await this.#turn;
    }
  }
}

/** One texture while it is filled. */
class Target {
  #gl;
  #entries;
  #form;
  #use;
  #volume;
  #source;
  /** @type {Level[]} */
  #levels = [];
  /** Of each slab that was sent. @type {WebGLSync[]} */
  #fences = [];
  /** Whether its size may still change, and whether it must be drawn to flush the upload. */
  #mutable = false;
  #waits = false;
  /** Whether nothing more may be sent: output of a worker comes too late. */
  #gone = false;
  /** @type {import("./upload_memory.js").Settler | null} */
  #settler = null;

  /** @param {Gl} gl @param {Texture[]} entries @param {Form} form @param {(work: () => void) => void} use */
  constructor(gl, entries, form, use) {
    const [{ gl: how }] = entries;
    this.#gl = gl;
    this.#use = use;
    this.#entries = entries;
    this.#form = form;
    this.#volume = how.target === "TEXTURE_3D";
    this.#source = FORMATS[how.internal_format];
    const handle = gl.createTexture();
    if (!handle) throw new VolpkgError("VP7018", { problem: "the context is lost" });
    /** @type {Made} */
    this.made = { handle, target: /** @type {any} */ (gl)[how.target], bytes: 0 };
  }

  /** @param {Uint8Array} texels of the only level */
  fill(texels) {
    const size = texels.length;
    this.#use(() => this.#room([{ offset: 0, stored: size, size, shape: this.#entries[0].shape_zyx, packed: false }]));
    this.take(texels, 0);
  }

  /** Makes room on the GPU. @param {Place[]} places */
  async begin(places) {
    this.#use(() => this.#room(places));
    if (!places[0].packed) return;
    const { framesOf } = await import("../net/workers.js");
    for (const level of this.#levels) {
      const emit = (/** @type {Uint8Array} */ texels) => this.#fill(level, texels);
      level.frames = await framesOf(level.place.size, emit, this.#entries[0].file);
    }
  }

  /** @param {Place[]} places */
  #room(places) {
    const finer = this.#form.finer ?? 1;
    forgetErrors(this.#gl);
    this.#bind();
    this.#levels = places.map((place, level) => {
      const [z, y, x] = place.shape;
      // Unit of upload: whole slices of a volume, whole rows of blocks of a picture, or a whole table.
      const unit =
        finer > 1 ? place.size : this.#volume ? place.size / z : place.size / Math.ceil(y / this.#source.block);
      const slab = new Uint8Array(Math.min(place.size, unit * Math.max(1, Math.floor(SLAB / unit))));
      const shape = [z, finerSize(y, finer), finerSize(x, finer)];
      this.#reserve(level, shape, places.length);
      this.made.bytes += texelBytes(this.#form.internal, shape);
      return { level, place, unit, slab, filled: 0, at: 0, frames: null };
    });
    this.#parameters(places.length);
    this.#check("making room for");
  }

  /** Bytes of the file from `start` on. @param {Uint8Array} piece @param {number} start */
  take(piece, start) {
    for (const level of this.#levels) {
      const { offset, stored } = level.place;
      const part = piece.subarray(Math.max(offset - start, 0), Math.max(offset + stored - start, 0));
      if (level.frames) level.frames.take(part);
      else this.#fill(level, part);
    }
  }

  /**
   * Waits until the upload is done: drivers buffer faster uploads, up to the size of the texture.
   * @param {AbortSignal} signal
   */
  async sent(signal) {
    const gl = /** @type {WebGL2RenderingContext} */ (this.#gl);
    for (const { frames } of this.#levels) await frames?.settle?.();
    if (this.#waits) {
      const { Settler } = await import("./upload_memory.js");
      this.#use(() => (this.#settler ??= new Settler(gl)).settle(this.made.handle));
      this.#waits = false;
    }
    while (this.#fences.length) {
      check(signal);
      const isThere = gl.isContextLost() || gl.getSyncParameter(this.#fences[0], gl.SYNC_STATUS) === gl.SIGNALED;
      if (isThere) gl.deleteSync(/** @type {WebGLSync} */ (this.#fences.shift()));
      else await new Promise((resolve) => setTimeout(resolve, 1));
    }
  }

  dispose() {
    for (const { frames } of this.#levels) frames?.end?.();
    this.#gone = true;
    this.#use(() => this.#settler?.dispose());
  }

  /** Throws if the driver could not do it. */
  async finish() {
    for (const { frames } of this.#levels) await frames?.finish();
    this.#check("uploading");
  }

  /** Texels that follow those before. @param {Level} level @param {Uint8Array} texels */
  #fill(level, texels) {
    let from = 0;
    while (from < texels.length && !this.#gone) {
      const part = texels.subarray(from, from + level.slab.length - level.filled);
      level.slab.set(part, level.filled);
      level.filled += part.length;
      from += part.length;
      const done = level.at + level.filled === level.place.size;
      if (done || level.filled === level.slab.length) this.#use(() => this.#send(level));
      if (done) level.slab = new Uint8Array(0);
    }
  }

  #bind() {
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(this.made.target, this.made.handle);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    if (isWebGl2(gl)) {
      gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
      for (const value of [
        gl.UNPACK_ROW_LENGTH,
        gl.UNPACK_IMAGE_HEIGHT,
        gl.UNPACK_SKIP_PIXELS,
        gl.UNPACK_SKIP_ROWS,
        gl.UNPACK_SKIP_IMAGES,
      ])
        gl.pixelStorei(value, 0);
    }
  }

  /** @param {number} level @param {number[]} shape z, y, x @param {number} levels */
  #reserve(level, [z, y, x], levels) {
    const gl = this.#gl;
    const [internal, format, type] = this.#names();
    // Of sizes that may still change, drivers keep all texels twice until they are first drawn.
    if (isWebGl2(gl) && internal !== format) {
      if (level) return;
      if (this.#volume) gl.texStorage3D(this.made.target, levels, internal, x, y, z);
      else gl.texStorage2D(this.made.target, levels, internal, x, y);
    } else if (format !== undefined) {
      this.#mutable = true;
      gl.texImage2D(this.made.target, level, internal, x, y, 0, format, /** @type {number} */ (type), null);
    }
  }

  /** @param {number} levels */
  #parameters(levels) {
    const gl = this.#gl;
    const { target } = this.made;
    const near = this.#form.finer || this.#entries[0].filter === "nearest" ? "NEAREST" : "LINEAR";
    const far = levels > 1 ? /** @type {const} */ (`${near}_MIPMAP_${near}`) : near;
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl[near]);
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, /** @type {any} */ (gl)[far]);
    gl.texParameteri(target, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(target, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    if (isWebGl2(gl)) {
      gl.texParameteri(target, gl.TEXTURE_WRAP_R, gl.CLAMP_TO_EDGE);
      gl.texParameteri(target, gl.TEXTURE_MAX_LEVEL, levels - 1);
    }
  }

  /** @param {Level} level */
  #send(level) {
    const gl = this.#gl;
    const [internal, format, type] = this.#names();
    const [, height, width] = level.place.shape;
    const first = level.at / level.unit;
    const units = level.filled / level.unit;
    const finer = this.#form.finer ?? 1;
    const bytes = level.slab.subarray(0, level.filled);
    const data = this.#form.convert?.(bytes, width) ?? typed(gl, bytes, type);
    this.#bind();
    const { target } = this.made;
    if (format === undefined) {
      const { block } = this.#source;
      const rows = Math.min(units * block, height - first * block);
      gl.compressedTexSubImage2D(target, level.level, 0, first * block, width, rows, internal, data);
    } else if (this.#volume) {
      /** @type {WebGL2RenderingContext} */ (gl).texSubImage3D(
        target,
        level.level,
        0,
        0,
        first,
        width,
        height,
        units,
        format,
        type,
        data,
      );
    } else {
      const rows = finer > 1 ? finerSize(height, finer) : units;
      gl.texSubImage2D(target, level.level, 0, first, finerSize(width, finer), rows, format, type, data);
    }
    level.at += level.filled;
    level.filled = 0;
    this.#waits = this.#mutable && this.made.bytes > SLAB;
    const fence = isWebGl2(gl) && gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (fence) this.#fences.push(fence);
    gl.flush();
  }

  /** Numbers of internal format, pixel format and type. @returns {[number, number | undefined, number]} */
  #names() {
    const { internal } = this.#form;
    const { extension, format, type } = FORMATS[internal];
    const gl = /** @type {any} */ (this.#gl);
    return [/** @type {number} */ (constant(this.#gl, internal, extension)), format && gl[format], type && gl[type]];
  }

  /** @param {string} operation */
  #check(operation) {
    const gl = this.#gl;
    if (gl.isContextLost()) throw new VolpkgError("VP7018", { problem: "the context is lost" });
    const error = gl.getError();
    if (error === gl.NO_ERROR) return;
    const name =
      { [gl.OUT_OF_MEMORY]: "GL_OUT_OF_MEMORY", [gl.INVALID_VALUE]: "GL_INVALID_VALUE" }[error] ?? `error ${error}`;
    throw new VolpkgError("VP5007", {
      error: name,
      operation: `${operation} texture ${this.#entries[0].name}`,
      driver: driverOf(gl),
    });
  }
}

/** Bytes as the numbers that WebGL wants for a type. @param {Gl} gl @param {Uint8Array} bytes @param {number} type */
function typed(gl, bytes, type) {
  if (type === gl.BYTE) return new Int8Array(bytes.buffer, bytes.byteOffset, bytes.length);
  return type === gl.UNSIGNED_BYTE ? bytes : new Uint16Array(bytes.buffer, bytes.byteOffset, bytes.length / 2);
}
