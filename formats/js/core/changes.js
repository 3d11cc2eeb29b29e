/** Changes that an app has made: transfer functions, segments, cuts, the light. */

/** @typedef {import("../draw/clip.js").Clip} Clip */
/** @typedef {import("./package.js").Package} Package */
/** @typedef {import("./types.js").TransferFunction} TransferFunction */

/** The changes of one renderer. */
export class Changes {
  #pack;
  /** Whether rays always end at a depth. */
  #depth;
  /** Planes that each picture adds. */
  more = 0;
  /** Transfer functions that were edited, by the name of the one they replace. @type {Map<string, import("../edit/edit.js").Edit>} */
  edits = new Map();
  /** Looks of segments, if an app has changed one. @type {import("../draw/segments.js").Segments | null} */
  segments = null;
  /** The cut that was asked for. @type {import("../draw/clip.js").Wanted | null} */
  cut = null;
  /** @type {Clip | null} */
  clip = null;
  /** Where the light is, or the light around the volume, if an app has changed it. @type {import("../draw/light.js").Light} */
  light = null;
  /** Counts changes that need another load of the level. */
  version = 0;

  /** @param {Package} pack @param {boolean} [depth] */
  constructor(pack, depth = false) {
    this.#pack = pack;
    this.#depth = depth;
  }

  /** Points of a transfer function as it is now. @param {string} name */
  points(name) {
    return this.edits.get(name)?.points ?? this.#own(name);
  }

  /** @param {import("../edit/edit.js").Wish | null} edited @param {string} name */
  async setTransfer(edited, name) {
    const { checkEdit } = await import("../edit/edit.js");
    if (edited === null) this.edits.delete(name);
    else this.edits.set(name, checkEdit(this.#pack, edited, name));
    this.version++;
  }

  /** @param {{level: number, width: number} | null} window @param {string} name */
  async setWindow(window, name) {
    const { windowed } = await import("../edit/edit.js");
    await this.setTransfer(window && windowed(this.#own(name), window), name);
  }

  /** @param {readonly (readonly [name: string, look: import("../draw/segments.js").Look | null])[]} looks */
  async setSegments(looks) {
    const { Segments } = await import("../draw/segments.js");
    const segments = this.segments ?? new Segments(this.#pack.manifest, this.#pack.name);
    for (const [name, look] of looks) segments.set(name, look);
    this.segments = segments;
    this.version++;
  }

  /** @param {import("../draw/clip.js").Wanted | null} cut @param {number} [more] planes that each picture adds */
  async setClip(cut, more = this.more) {
    const { clipOf } = await import("../draw/clip.js");
    const made = clipOf({ ...cut, depth: Boolean(cut?.depth || this.#depth) }, more, this.#pack.manifest);
    this.more = more;
    this.cut = cut;
    // Clips of one key differ in values only.
    if (made?.key !== this.clip?.key) this.version++;
    this.clip = made;
  }

  /** Points of a transfer function of the package. @param {string} name */
  #own(name) {
    return this.#pack.transferFunctions.find((each) => each.name === name)?.points ?? [];
  }

  /** @param {import("../draw/light.js").Light} light */
  async setLight(light) {
    (await import("../draw/light.js")).checkLight(this.#pack, light);
    this.light = light;
  }
}
