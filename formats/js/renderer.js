/** Draws a package with WebGL 1 or 2. */
import { choose, nothing, stepOf } from "./choose.js";
import { Device, checkFits } from "./device.js";
import { VolpkgError } from "./error.js";
import { bind, load } from "./load.js";

/** @typedef {import("./formats.js").Gl} Gl */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("./clip.js").Behind} Behind */
/** @typedef {import("./clip.js").Clip} Clip */
/** @typedef {import("./load.js").Drawn} Drawn */
/** @typedef {import("./textures.js").Made} Made */
/** @typedef {import("./types.js").TransferFunction} TransferFunction */
/** @typedef {readonly [x: number, y: number, width: number, height: number]} Viewport */
/** Depth of what is opaque, as large as the picture; reversed if 1 is the near plane. @typedef {{texture: WebGLTexture, reversed?: boolean}} Depth */
/**
 * @typedef {object} RendererOptions
 * @property {string} [program] which picture: the name of a transfer function, or of several channels together; the first if absent
 * @property {number} [level] the finest that fits if absent
 * @property {number} [maxTextureBytes] what textures may take together; what the package's profile allows if absent
 * @property {import("./draco.js").DecodeDraco} [decodeDraco] unpacks meshes that are compressed with Draco; they are left out if absent
 * @property {number} [frameMs] how long a picture may take while the camera moves, 25 if absent
 * @property {(work: () => void) => void} [around] called with each use of the context, for apps that keep state of their own
 * @property {(error: unknown) => void} [onError] told of what fails behind: a finer level, or a context that came back
 */

/** Draws one picture at one level. Get one from `createRenderer`. */
export class Renderer {
  #gl;
  #pack;
  #options;
  /** @type {Device | null} */
  #device = null;
  /** @type {Drawn | null} */
  #drawn = null;
  #want = { picture: "", level: 0, point: /** @type {number | null} */ (null) };
  /** Transfer functions that were edited, by the name of the one they replace. @type {Map<string, TransferFunction>} */
  #edits = new Map();
  /** @type {Clip | null} */
  #clip = null;
  /** Counts changes of edits and clip, so that what was loaded meanwhile follows them. */
  #version = 0;
  /** Textures of what is being loaded. @type {Set<Made[]>} */
  #held = new Set();
  #abort = new AbortController();
  #listeners = new AbortController();
  /** Once the camera has moved. @type {import("./pace.js").Pace | null} */
  #pace = null;
  #moving = false;
  /** Where the light is, if an app has moved it. @type {readonly number[] | null} */
  #light = null;
  /** Distance of samples that was asked for. @type {number | undefined} */
  #step;

  /** Called whenever a new picture is worth drawing: a finer level has come, or something was changed. @type {() => void} */
  onchange = () => {};
  /** Fulfilled when the level that is wanted is drawn, or another one was asked for meanwhile. @type {Promise<unknown>} */
  ready = Promise.resolve();

  /** @param {Gl} gl @param {Package} pack @param {RendererOptions} options */
  constructor(gl, pack, options) {
    this.#gl = gl;
    this.#pack = pack;
    this.#options = options;
    const { signal } = this.#listeners;
    const canvas = /** @type {EventTarget} */ (gl.canvas);
    canvas.addEventListener("webglcontextlost", (event) => this.#lose(event), { signal });
    canvas.addEventListener("webglcontextrestored", () => this.#restore(), { signal });
  }

  /** Name of the picture. */
  get program() {
    return this.#drawn?.choice.program.transfer ?? this.#want.picture;
  }

  /** Pictures that can be drawn. */
  get programs() {
    return this.#pack.programs;
  }

  /** Place and size of the volume, as cameras want it. */
  get grid() {
    return this.#pack.manifest.grid;
  }

  /** Index of the level that is drawn. */
  get level() {
    return this.#drawn?.choice.level.index ?? -1;
  }

  /** Levels that the picture has and that fit this device, the finest first. */
  get levels() {
    return this.#levels(this.#want.picture);
  }

  /** Distance of samples in millimetres. */
  get step() {
    return this.#step ?? this.packageStep;
  }

  /** Distance of samples in millimetres that the package asks for at the level that is drawn. */
  get packageStep() {
    return stepOf(this.#pack.manifest, this.level);
  }

  /** What this device cannot do and what was done in place of it; and a level that could not be drawn, and why. */
  get notes() {
    return this.#drawn?.notes ?? [];
  }

  /** What was found by drawing a few texels, by name, and how long that took. */
  get probes() {
    return { milliseconds: this.#device?.probes.milliseconds ?? 0, found: Object.fromEntries(this.#device?.probes.found ?? []) };
  }

  /** Bytes of the textures on the GPU. */
  get textureBytes() {
    return this.#device?.textures.bytes ?? 0;
  }

  /** How pictures are drawn now: times the step, and the share of the pixels along an axis. */
  get quality() {
    return (this.#moving && this.#pace?.quality) || { step: 1, scale: 1 };
  }

  /** Begins: the coarsest level that is to be had is drawable when the promise is fulfilled. */
  async start() {
    const { program = this.#pack.programs[0]?.name, level } = this.#options;
    this.#prepare();
    try {
      if (!program) throw nothing(this.#pack, "any", "any");
      const fits = this.#levels(program);
      if (level !== undefined) this.#fits(choose(this.#pack, program, level));
      else if (!fits.length) this.#fits(choose(this.#pack, program, Math.max(...(this.programs.find(({ name }) => name === program)?.levels ?? [-1]))));
      this.#want = { picture: program, level: level ?? fits[0], point: null };
      await this.#climb(true);
    } catch (error) {
      this.dispose();
      throw error;
    }
    return this;
  }

  /**
   * Draws another picture, at the level that is wanted or the finest that it has.
   * @param {string} name
   * @returns {Promise<boolean>} false if another request came first
   */
  setProgram(name) {
    const levels = this.#levels(name);
    if (!levels.length) return Promise.reject(nothing(this.#pack, name, "any"));
    this.#want = { picture: name, level: levels.includes(this.#want.level) ? this.#want.level : levels[0], point: null };
    return this.#climb(false);
  }

  /**
   * Draws another level; coarser ones on the way to a finer one are drawn as they come.
   * @param {number} index
   * @returns {Promise<boolean>} false if another request came first
   */
  async setLevel(index) {
    this.#fits(choose(this.#pack, this.#want.picture, index));
    this.#want = { ...this.#want, level: index, point: null };
    return this.#climb(false);
  }

  /**
   * Draws level 0 around a point of the grid of sub-volumes; null draws the level again.
   * @param {number | null} point
   * @returns {Promise<boolean>} false if another request came first
   */
  setPoint(point) {
    this.#want = { ...this.#want, point };
    return this.#climb(false);
  }

  /**
   * Distance of samples in millimetres at all levels; the package's own for each level if absent.
   * @param {number} [mm]
   */
  setStep(mm) {
    const least = this.#drawn?.choice.program.step_mm_min ?? 0;
    const reason = mm === undefined ? "" : mm > 0 && Number.isFinite(mm) ? mm < least && `the shader's loop is long enough for ${least} mm and more` : "it must be a positive number";
    if (reason) throw new VolpkgError("VP5019", { step_mm: mm, reason });
    this.#step = mm;
    this.onchange();
  }

  /**
   * Draws with an edited transfer function; null takes the edit back.
   * @param {{points: TransferFunction["points"], reference_mm?: number} | null} edited
   * @param {string} [name] of the transfer function that it replaces; that of the picture if absent
   */
  async setTransfer(edited, name = this.#want.picture) {
    const { checkEdit } = await import("./edit.js");
    if (edited === null) this.#edits.delete(name);
    else this.#edits.set(name, checkEdit(this.#pack, edited, name));
    await this.#refresh();
  }

  /**
   * Shows only a box and what lies on the inner sides of planes; null shows everything.
   * @param {{box?: readonly [low: readonly number[], high: readonly number[]], planes?: readonly (readonly number[])[], depth?: boolean} | null} clip
   *   box millimetres; of a plane (a, b, c, d) the side where a·x + b·y + c·z + d > 0 is shown; with `depth`, rays end at
   *   the depth that `draw` is given
   */
  async setClip(clip) {
    const { clipOf } = await import("./clip.js");
    this.#clip = clip && clipOf(clip);
    await this.#refresh();
  }

  /**
   * Moves the light with a place that programs are lit by; null puts it back.
   * @param {readonly number[] | null} place x, y, z in the patient's space (LPS), millimetres
   */
  async setLight(place) {
    (await import("./light.js")).checkLight(this.#pack, place);
    this.#light = place;
    this.onchange();
  }

  /**
   * Says whether the camera moves: pictures are then drawn coarser, as far as their time demands it.
   * @param {boolean} moving
   */
  interacting(moving) {
    if (this.#moving === moving) return;
    this.#moving = moving;
    if (moving && !this.#pace) import("./pace.js").then(({ Pace }) => (this.#pace ??= new Pace(this.#gl, this.#options.frameMs ?? 25)));
    this.onchange();
  }

  /**
   * Draws a picture, premultiplied linear RGBA.
   * @param {object} how
   * @param {ArrayLike<number>} how.boxFromClip 16 numbers, column by column, from clip coordinates to box millimetres
   * @param {Viewport} [how.viewport] of the target, or size of the own picture; the whole canvas if absent
   * @param {WebGLFramebuffer | null} [how.target] null is the canvas; a picture of its own, which `present` shows, if absent
   * @param {Depth} [how.depth] of what is opaque, after `setClip` asked for it
   * @param {boolean} [how.blend] over what is there, in a target that is linear; replaces it if absent
   * @returns {boolean} false if there is nothing to draw with, because the context is lost
   */
  draw({ boxFromClip, viewport = this.#whole(), target, depth, blend = false }) {
    const drawn = this.#drawn;
    const device = this.#device;
    if (!drawn || !device) return false;
    const { scale, step } = this.quality;
    const { choice, linked } = drawn;
    this.#use(() => {
      const gl = this.#gl;
      const [x, y, width, height] = viewport;
      const own = target === undefined;
      const mesh = own && !this.#edits.size && !drawn.clip && drawn.mesh ? drawn.mesh.front(boxFromClip) : null;
      this.#pace?.before(this.#moving);
      const bindTarget = () => {
        if (own) device.picture.bind(Math.ceil(width * scale), Math.ceil(height * scale), mesh !== null);
        else gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      };
      bindTarget();
      const size = own ? [device.picture.width, device.picture.height] : [width, height];
      const place = /** @type {const} */ ([own ? 0 : x, own ? 0 : y, size[0], size[1]]);
      gl.viewport(...place);
      device.state(blend);
      const behind = depth ? { ...depth, pixel: size, boxFromClip } : null;
      const values = { ...choice.values, ...drawn.lightOf?.(this.grid, choice.program, this.#light), box_from_clip: Array.from(boxFromClip), step_mm: Math.max(this.step * step, choice.program.step_mm_min ?? 0) };
      if (mesh) mesh.draw((linked, program) => bind(gl, drawn, linked, program, { ...values, ...mesh.values }, behind));
      else if (drawn.technique) {
        drawn.technique.draw(linked, { values, viewport: place, bindTarget, bind: (to, inputs, all) => bind(gl, drawn, to, inputs, all, behind) });
      } else {
        bind(gl, drawn, linked, choice.program, values, behind);
        device.triangle();
        gl.drawArrays(gl.TRIANGLES, 0, 3);
      }
      device.unbind();
      this.#pace?.after(this.#moving);
    });
    return true;
  }

  /**
   * Shows the own picture, encoded as sRGB.
   * @param {{viewport?: Viewport, background?: readonly number[], target?: WebGLFramebuffer | null}} [how] background: linear red, green, blue
   */
  present({ viewport = this.#whole(), background = [0, 0, 0], target = null } = {}) {
    const device = this.#device;
    if (!device?.picture.texture) return;
    this.#use(() => {
      const gl = this.#gl;
      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      device.state(false);
      device.picture.present(viewport, background);
      device.unbind();
    });
  }

  /** The own picture: premultiplied linear RGBA, row 0 on top. `format` is what it was kept in. */
  readPixels() {
    const picture = this.#device?.picture;
    if (!picture?.texture) throw new VolpkgError("VP7018", { problem: "no picture was drawn" });
    let pixels = /** @type {Float32Array} */ (new Float32Array(0));
    this.#use(() => {
      pixels = picture.read();
      this.#gl.bindFramebuffer(this.#gl.FRAMEBUFFER, null);
    });
    return { width: picture.width, height: picture.height, format: picture.format, pixels };
  }

  /** Texture of the own picture, for apps that show it themselves. */
  get texture() {
    return this.#device?.picture.texture ?? null;
  }

  /** Frees everything on the GPU. */
  dispose() {
    this.#abort.abort();
    this.#listeners.abort();
    this.#free();
  }

  #whole() {
    const { drawingBufferWidth, drawingBufferHeight } = this.#gl;
    return /** @type {const} */ ([0, 0, drawingBufferWidth, drawingBufferHeight]);
  }

  /** @param {string} picture */
  #levels(picture) {
    const all = this.#pack.programs.find(({ name }) => name === picture)?.levels ?? [];
    return all.filter((index) => {
      try {
        this.#fits(choose(this.#pack, picture, index));
      } catch {
        return false;
      }
      return true;
    });
  }

  /** Throws if the device does not take it. @param {import("./choose.js").Choice} choice */
  #fits(choice) {
    checkFits(this.#gl, this.#pack, choice, this.#options.maxTextureBytes);
  }

  /** Makes what does not depend on the picture. */
  #prepare() {
    this.#use(() => (this.#device = new Device(this.#gl, this.#pack)));
  }

  /**
   * Loads what is wanted, by way of coarser levels. Of levels that this device draws wrongly it takes the next.
   * @param {boolean} first whether the rest goes on behind once something can be drawn
   * @returns {Promise<any>}
   */
  async #climb(first) {
    this.#abort.abort();
    this.#abort = new AbortController();
    const { signal } = this.#abort;
    const { picture, level, point } = this.#want;
    const now = this.#drawn?.choice.level.index;
    const coarser = this.#levels(picture).filter((each) => each >= level).reverse();
    const from = point === null && now !== undefined && now >= level ? coarser.indexOf(now) : 0;
    const steps = point !== null || (now !== undefined && now < level) ? [level] : coarser.slice(Math.max(from, 0));
    /** @type {unknown} */
    let failed;
    const go = async (/** @type {number} */ index) => {
      try {
        await this.#swap(index, signal);
        failed = undefined;
      } catch (error) {
        // Of what a device draws wrongly, another level may have another format.
        if (!(error instanceof VolpkgError && error.code === "VP7014")) throw error;
        failed ??= error;
      }
    };
    /** @type {() => void} */
    let tell = () => {};
    const begun = new Promise((resolve) => (tell = () => resolve(true)));
    const all = async () => {
      for (const index of steps) {
        await go(index);
        if (this.#drawn) tell();
      }
      if (failed && !this.#drawn) throw failed;
      if (failed) this.#drawn?.notes.push(/** @type {Error} */ (failed).message);
      return true;
    };
    const work = all().catch((error) => {
      if (signal.aborted) return false;
      throw error;
    });
    this.ready = work;
    work.catch((error) => first && this.#drawn && this.#options.onError?.(error));
    return first ? Promise.race([begun, work]) : work;
  }

  /** Loads a level and draws with it from then on. @param {number} index @param {AbortSignal} signal */
  async #swap(index, signal) {
    const device = this.#device;
    if (!device) throw new VolpkgError("VP7018", { problem: "the context is lost, or the renderer disposed of" });
    /** @type {Made[]} */
    const held = [];
    this.#held.add(held);
    try {
      let version;
      /** @type {Drawn} */
      let drawn;
      do {
        version = this.#version;
        const { maxTextureBytes: limit, decodeDraco } = this.#options;
        const how = { edits: this.#edits, clip: this.#clip, limit, decodeDraco, use: (/** @type {() => void} */ work) => this.#use(work) };
        drawn = await load({ gl: this.#gl, pack: this.#pack, device, ...this.#want, level: index, ...how, signal, held });
        if (version !== this.#version || signal.aborted) discard(drawn);
        signal.throwIfAborted();
      } while (version !== this.#version);
      discard(this.#drawn);
      this.#drawn = drawn;
    } finally {
      this.#held.delete(held);
      if (this.#device === device) this.#use(() => device.textures.keep([...(this.#drawn?.textures ?? []), ...[...this.#held].flat()]));
    }
    this.onchange();
  }

  /** Draws with the edits and the clip as they are now. */
  async #refresh() {
    this.#version++;
    const { signal } = this.#abort;
    try {
      if (this.#drawn) await this.#swap(this.#drawn.choice.level.index, signal);
    } catch (error) {
      if (!signal.aborted) throw error;
      // What came first has the edits and the clip, too.
      await this.ready;
    }
  }

  /** @param {() => void} work */
  #use(work) {
    if (this.#options.around) this.#options.around(work);
    else work();
  }

  /** @param {Event} event */
  #lose(event) {
    event.preventDefault();
    this.#abort.abort();
    this.#free();
  }

  async #restore() {
    try {
      this.#prepare();
      await this.#climb(true);
    } catch (error) {
      this.#options.onError?.(error);
    }
  }

  #free() {
    const device = this.#device;
    if (!device) return;
    this.#device = null;
    this.#use(() => {
      discard(this.#drawn);
      this.#drawn = null;
      device.dispose();
      this.#pace?.dispose();
    });
  }
}

/** Frees what only one picture at one level has. @param {Drawn | null} drawn */
function discard(drawn) {
  drawn?.mesh?.dispose();
  drawn?.technique?.dispose();
}

/**
 * Draws a package in a context. The coarsest level can be drawn when the promise is fulfilled; finer ones follow, and
 * `onchange` tells of each.
 * @param {Gl} gl
 * @param {Package} pack
 * @param {RendererOptions} [options]
 * @returns {Promise<Renderer>}
 */
export function createRenderer(gl, pack, options = {}) {
  return new Renderer(gl, pack, options).start();
}
