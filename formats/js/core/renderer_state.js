/** The state of a renderer: package, picture, level, step, transfer functions, segments, cuts and light. */
import { VolpkgError } from "./error.js";
import { Levels } from "./levels.js";
import { Changes } from "./changes.js";

/** @typedef {import("../gl/formats.js").Gl} Gl */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("./types.js").TransferFunction} TransferFunction */
/** @typedef {import("./options.js").RendererOptions} RendererOptions */

/**
 * Of a ray: enough for a quarter of a voxel of 2048³. A step that a package only claims must not keep a device busy for
 * hours.
 */
const MOST_SAMPLES = 16384;

/** The settings of a `Renderer`, which draws them. */
export class RendererState extends EventTarget {
  #pack;
  #options;
  /** Counts changes that make the last picture outdated. */
  #revision = 0;
  /** Distance of samples that was asked for. @type {number | undefined} */
  #step;
  /** @protected */
  _changes;
  /** @protected */
  _levels;

  /** Called as listeners of "change" are. @type {() => void} */
  onchange = () => {};

  /** @param {Gl} gl @param {Package} pack @param {RendererOptions} options */
  constructor(gl, pack, options) {
    super();
    this.#pack = pack;
    this.#options = options;
    this._changes = new Changes(pack, options.depth);
    this._levels = new Levels(gl, pack, options, this._changes, this.use.bind(this), this._changed.bind(this));
  }

  /** The package that is drawn. */
  get package() {
    return this.#pack;
  }

  /**
   * Fulfilled when the level that is wanted is drawn, or another one was asked for meanwhile.
   * @returns {Promise<unknown>}
   */
  get ready() {
    return this._levels.ready;
  }

  /** Name of the picture. */
  get program() {
    return this._levels.drawn?.choice.picture ?? this._levels.want.picture;
  }

  /** Pictures that can be drawn. */
  get programs() {
    return this.#pack.programs;
  }

  /** Place and size of the volume, as cameras want it. Pictures of channels on other grids have another one. */
  get grid() {
    const { pictures, grid } = this.#pack.manifest;
    return pictures.find(({ name }) => name === this.program)?.grid ?? grid;
  }

  /** Index of the level that is drawn. */
  get level() {
    return this._levels.drawn?.choice.level.index ?? -1;
  }

  /** Number of the frame that is drawn. */
  get frame() {
    return this._levels.drawn?.choice.drawing?.frame ?? 0;
  }

  /** Levels that the picture has and that fit this device, the finest first. */
  get levels() {
    return this._levels.of(this._levels.want.picture);
  }

  /** Distance of samples in millimetres. */
  get step() {
    return this.#step ?? this.packageStep;
  }

  /** Distance of samples in millimetres that the package asks for at the level that is drawn. */
  get packageStep() {
    return this._levels.drawn?.choice.stepMm ?? this.#pack.manifest.pictures[0].drawings[0].step_mm ?? 0;
  }

  /** Missing features of this device with their fallbacks, and levels that could not be drawn, with the reason. */
  get notes() {
    const { device, drawn } = this._levels;
    const kind = device?.pictures.kind.name ?? "RGBA16F";
    const coarse =
      kind === "RGBA16F" ? [] : [`pictures are kept in ${kind}, without half floats: dark parts may show bands`];
    return coarse.concat(drawn?.notes ?? []);
  }

  /** A number that changes whenever the same camera would see another picture. */
  get revision() {
    return this.#revision;
  }

  /** Results of the probes that draw a few texels, by name, and their time. */
  get probes() {
    const { milliseconds = 0, found = new Map() } = this._levels.device?.probes ?? {};
    return { milliseconds, found: Object.fromEntries(found) };
  }

  /** Bytes of the textures on the GPU. */
  get textureBytes() {
    return this._levels.device?.textures.bytes ?? 0;
  }

  /**
   * Draws another picture, at the level that is wanted or the finest that it has.
   * @param {string} name
   * @returns {Promise<boolean>} false if another request came first
   */
  setProgram(name) {
    return this._levels.setPicture(name);
  }

  /**
   * Draws another level; coarser ones on the way to a finer one are drawn as they come.
   * @param {number} index
   * @returns {Promise<boolean>} false if another request came first
   */
  async setLevel(index) {
    const levels = this._levels;
    levels.require(levels.want.picture, index);
    return levels.draw({ level: index, point: null });
  }

  /**
   * Draws another frame of a time series, or the one that is seen at a time in seconds.
   * @param {number | {seconds: number}} frame
   */
  async setFrame(frame) {
    return (await import("./frames.js")).show(this, frame, this.#options);
  }

  /**
   * Draws level 0 around a point of the grid of sub-volumes; null draws the level again.
   * @param {number | null} point
   * @returns {Promise<boolean>} false if another request came first
   */
  setPoint(point) {
    return this._levels.draw({ point });
  }

  /**
   * Distance of samples in millimetres at all levels; the package's step of each level if absent.
   * @param {number} [mm]
   */
  setStep(mm) {
    const least = this._least();
    if (mm !== undefined && !(mm >= least && mm < Infinity))
      throw new VolpkgError("VP5019", { step_mm: mm, reason: `it must be a number from ${least} on` });
    this.#step = mm;
    this._changed();
  }

  /** Points of the transfer function of the picture, as it is now. */
  get points() {
    return this._changes.points(this.program);
  }

  /**
   * Draws with an edited transfer function; null takes the edit back. A channel on a grid of its own in a picture of
   * several may also be faded, by a factor of its extinction: 0 hides it.
   * @param {import("../edit/edit.js").Wish | null} edited
   * @param {string} [name] of the transfer function that it replaces; that of the picture if absent
   */
  async setTransfer(edited, name = this._levels.want.picture) {
    await this._changes.setTransfer(edited, name);
    await this.#refresh(name);
  }

  /**
   * Moves and stretches the transfer function of the package, so that its points cover a window of values; null puts it
   * back.
   * @param {{level: number, width: number} | null} window the value in the middle, and the difference of the values at
   *   both ends
   * @param {string} [name] of the transfer function; that of the picture if absent
   */
  async setWindow(window, name = this._levels.want.picture) {
    await this._changes.setWindow(window, name);
    await this.#refresh(name);
  }

  /** Draws with an edited function; begins to compute its light again, if the options ask for it. @param {string} name */
  async #refresh(name) {
    await this._levels.refresh();
    /** Fulfilled when the light of the last edit is computed again, or another edit came first. */
    if (this.#options.relight) this.relit = import("../edit/occlusion.js").then(({ relight }) => relight(this, name));
  }

  /**
   * Shows, hides, tints or fades a segment; null restores the package's look.
   * @param {string} name of a segment
   * @param {import("../draw/segments.js").Look | null} look tint: linear red, green, blue; absent fields keep their values
   */
  async setSegment(name, look) {
    return this.setSegments([[name, look]]);
  }

  /**
   * Changes several segments at one time.
   * @param {readonly (readonly [name: string, look: import("../draw/segments.js").Look | null])[]} looks
   */
  async setSegments(looks) {
    await this._changes.setSegments(looks);
    await this._levels.refresh();
  }

  /** Segments as they look now; none if the package has none. */
  get segments() {
    return this._changes.segments?.all ?? this.#pack.manifest.segments?.segments ?? [];
  }

  /**
   * Shows only a box and the inner sides of planes; null shows everything.
   * @param {import("../draw/clip.js").Wanted | null} clip box millimetres; of a plane (a, b, c, d) the side where
   *   a·x + b·y + c·z + d > 0 is shown; with `depth`, rays end at the depth that `draw` is given
   * @param {number} [more] planes that each picture adds; as many as before if absent
   */
  async setClip(clip, more) {
    const { version } = this._changes;
    await this._changes.setClip(clip, more);
    this._levels.adopt();
    if (version !== this._changes.version) return this._levels.refresh();
    this._changed();
  }

  /**
   * Moves the light with a place, or turns and colours the light around the volume; null puts the light back.
   * @param {import("../draw/light.js").Light} light x, y, z in the patient's space (LPS), millimetres; or the light around
   */
  async setLight(light) {
    await this._changes.setLight(light);
    this._changed();
  }

  /** For modules of this reader: uses the context as `draw` does. @param {() => void} work */
  use(work) {
    if (this.#options.around) this.#options.around(work);
    else work();
  }

  /** @protected */
  _changed() {
    this.#revision++;
    this.onchange();
    this.dispatchEvent(new Event("change"));
  }

  /** The shortest step that the loops of the shader allow, with at most MOST_SAMPLES across the volume. @protected */
  _least() {
    return Math.max(
      this._levels.drawn?.choice.program.step_mm_min ?? 0,
      Math.hypot(...this.grid.extent_mm_zyx) / MOST_SAMPLES,
    );
  }
}
