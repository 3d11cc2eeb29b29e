/** The level that is drawn: the wanted one is loaded by way of coarser ones, and again where something was changed. */
import { check } from "./abort.js";
import { choose, nothing } from "./drawing.js";
import { climb, filesOf } from "./progressive.js";
import { Device, checkFits } from "../gl/device.js";
import { VolpkgError } from "./error.js";
import { load } from "./load.js";

/** @typedef {import("./changes.js").Changes} Changes */
/** @typedef {import("../gl/formats.js").Gl} Gl */
/** @typedef {import("./load.js").Drawn} Drawn */
/** @typedef {import("./options.js").RendererOptions} RendererOptions */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("../gl/textures.js").Made} Made */
/** @typedef {{picture: string, level: number, point: number | null, frame: number}} Want */

/** Loads the levels of one renderer, and frees them. */
export class Levels {
  #gl;
  #pack;
  #options;
  #changes;
  #use;
  #changed;
  /** Textures that are being loaded. @type {Set<Made[]>} */
  #held = new Set();
  #abort = new AbortController();
  /** Objects of the context; null while it is lost. @type {Device | null} */
  device = null;
  /** The drawing in use. @type {Drawn | null} */
  drawn = null;
  /** @type {Want} */
  want = { picture: "", level: 0, point: null, frame: 0 };
  /** Fulfilled when the wanted level is drawn, or another one was asked for. @type {Promise<unknown>} */
  ready = Promise.resolve();
  /** Whether nothing may be loaded any more. */
  closed = false;

  /**
   * @param {Gl} gl @param {Package} pack @param {RendererOptions} options @param {Changes} changes
   * @param {(work: () => void) => void} use called with each use of the context
   * @param {() => void} changed called when another level is drawn
   */
  constructor(gl, pack, options, changes, use, changed) {
    this.#gl = gl;
    this.#pack = pack;
    this.#options = options;
    this.#changes = changes;
    this.#use = use;
    this.#changed = changed;
  }

  /** Resolves when the coarsest available level can be drawn. */
  async start() {
    const { program = this.#pack.programs[0]?.name, level } = this.#options;
    if (this.#options.depth) await this.#changes.setClip(null);
    if (!program) throw nothing(this.#pack, "anything", "any level");
    const fits = this.of(program);
    if (level !== undefined) this.require(program, level);
    else if (!fits.length) this.require(program, Math.max(-1, ...this.#all(program)));
    this.want = { ...this.want, picture: program, level: level ?? fits[0] };
    await this.climb(true);
  }

  /** Levels of a picture that fit this device, the finest first. @param {string} picture */
  of(picture) {
    return this.#all(picture).filter((index) => {
      try {
        this.require(picture, index);
      } catch {
        return false;
      }
      return true;
    });
  }

  /** Throws if the device does not take it. @param {string} picture @param {number} level @param {number} [frame] */
  require(picture, level, frame = 0) {
    checkFits(this.#gl, this.#pack, choose(this.#pack, picture, level, frame), this.#options.maxTextureBytes);
  }

  /**
   * Draws another picture, at the level that is wanted or the finest that it has.
   * @param {string} picture
   * @returns {Promise<boolean>} false if another request came first
   */
  setPicture(picture) {
    const levels = this.of(picture);
    if (!levels.length) return Promise.reject(nothing(this.#pack, picture, "any level"));
    const level = levels.includes(this.want.level) ? this.want.level : levels[0];
    return this.draw({ picture, level, point: null });
  }

  /**
   * Draws something else from then on.
   * @param {Partial<Want>} want
   * @returns {Promise<boolean>} false if another request came first
   */
  draw(want) {
    this.want = { ...this.want, ...want };
    return this.climb(false);
  }

  /**
   * Loads coarser levels and then the wanted one. Skips a level that this device draws wrongly.
   * @param {boolean} first whether to resolve once a level can be drawn, and load the rest in the background
   * @returns {Promise<any>}
   */
  async climb(first) {
    if (this.closed) return false;
    this.#abort.abort();
    this.#abort = new AbortController();
    const { signal } = this.#abort;
    const { picture, level, point, frame } = this.want;
    const now = this.drawn?.choice.level.index ?? Infinity;
    const coarser = this.of(picture)
      .filter((value) => value >= level)
      .reverse();
    const steps = point !== null || now < level ? [level] : coarser.slice(Math.max(coarser.indexOf(now), 0));
    if (point === null)
      for (const index of steps) this.#pack.expect(filesOf(this.#pack, picture, index, frame), signal);
    // Files come meanwhile.
    if (!this.device) this.#use(() => (this.device = new Device(this.#gl, this.#pack)));
    /** @type {() => void} */
    let tell = () => {};
    const begun = new Promise((resolve) => (tell = () => resolve(true)));
    const reached = () => this.drawn && tell();
    const work = climb(steps, (index) => this.#swap(index, signal), reached)
      .then((failed) => {
        if (failed && !this.drawn) throw failed;
        if (failed) this.drawn?.notes.push(failed.message);
        return true;
      })
      .catch((error) => {
        if (signal.aborted || this.#pack.signal.aborted) return false;
        throw error;
      });
    this.ready = work;
    work.catch((error) => first && this.drawn && this.#options.onError?.(error));
    return first ? Promise.race([begun, work]) : work;
  }

  /** Draws with the changes as they are now. */
  async refresh() {
    const { signal } = this.#abort;
    try {
      if (this.drawn) await this.#swap(this.drawn.choice.level.index, signal);
    } catch (error) {
      if (!signal.aborted) throw error;
      // The first level has the changes, too.
      await this.ready;
    }
  }

  /** Draws with the clip as it is now, if only values of it have changed. */
  adopt() {
    const { drawn } = this;
    const { clip } = this.#changes;
    if (!drawn || drawn.clip === clip || drawn.clip?.key !== clip?.key) return;
    drawn.clip = clip;
    drawn.technique?.renew();
  }

  /** Ends loading, and frees everything on the GPU. @param {() => void} [also] frees more in the same use of the context */
  end(also) {
    this.#abort.abort();
    const { device } = this;
    if (!device) return;
    this.device = null;
    this.#use(() => {
      discard(this.drawn);
      this.drawn = null;
      device.dispose();
      also?.();
    });
  }

  /** Loads a level and draws with it from then on. @param {number} index @param {AbortSignal} signal */
  async #swap(index, signal) {
    const { device } = this;
    if (!device) throw new VolpkgError("VP7018", { problem: "the context is lost, or the renderer disposed of" });
    const changes = this.#changes;
    /** @type {Made[]} */
    const held = [];
    this.#held.add(held);
    try {
      let version;
      /** @type {Drawn} */
      let drawn;
      do {
        version = changes.version;
        const { edits, segments, clip } = changes;
        const how = { ...this.want, level: index, edits, segments, clip, use: this.#use, signal, held };
        drawn = await load({ ...this.#options, gl: this.#gl, pack: this.#pack, device, ...how });
        if (version !== changes.version || signal.aborted) discard(drawn);
        check(signal);
      } while (version !== changes.version);
      discard(this.drawn);
      this.drawn = drawn;
      this.adopt();
    } finally {
      this.#held.delete(held);
      const kept = [...(this.drawn?.textures ?? []), ...[...this.#held].flat()];
      if (this.device === device) this.#use(() => device.textures.keep(kept));
    }
    this.#changed();
  }

  /** @param {string} picture */
  #all(picture) {
    return this.#pack.programs.find(({ name }) => name === picture)?.levels ?? [];
  }
}

/** Frees the objects of one picture at one level. @param {Drawn | null} drawn */
function discard(drawn) {
  drawn?.mesh?.dispose();
  drawn?.technique?.dispose();
}
