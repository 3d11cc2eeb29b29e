/**
 * The measurement: nine views and a sweep of steps and levels, drawn here, read back, compared with the truth, timed.
 * Pictures come first, then times, so that a device that must stop early has reported its errors before its speed.
 */
import { drawingOf } from "../runtime/fidelity.js";
import { errorOf, truthPicture } from "./compare.js";
import { deviceNames } from "./device.js";
import { file, json } from "./files.js";
import { Clock } from "./timing.js";

const LIMIT_MS = 60_000;
/** Time that is kept for the last draw, which shows whether the device became slower. */
const KEPT_MS = 3_000;
const MOST_FOR_A_POINT_MS = 2_500;
const LEAST_FOR_A_POINT_MS = 250;
const NOMINAL_MS = 1_500;
/** Sizes of the picture, in units of that of the points: the last has the pixels of a small telephone. */
const SIZES = [1, 2, 4];
/** Time that is kept for them. */
const SIZES_MS = 8_000;
/** A size whose draw would take longer is left out. */
const MOST_FOR_A_SIZE_MS = 2_000;

/**
 * @typedef {{level: number, step_mm: number}} Point
 * @typedef {{view: string, box_from_clip: number[], file: string}} TruthView
 * @typedef {{program: string, transfer: string, level: number, views: TruthView[], sweep_view: string, points: Point[]}} TruthProgram
 * @typedef {{manifest_sha256: string, picture_size: number, step_mm: number, programs: TruthProgram[]}} Truth
 *
 * What draws, off the screen, for the measurement alone.
 * @typedef {object} Bench
 * @property {any} gl
 * @property {any} manifest
 * @property {{name: string, passed: boolean, note?: string}[]} probes
 * @property {(transfer: string, level: number) => Promise<void>} choose takes the program of a level, uploaded
 * @property {(boxFromClip: number[], stepMm: number, index: number) => void} draw draws into one of two targets
 * @property {() => Uint8Array} pixels of the target that was drawn last, RGBA, row 0 on top
 * @property {() => void} wait returns when everything has been drawn
 * @property {(size: number) => void} resize changes width and height of both targets
 * @property {(transfer: string, level: number) => string} form technique, and format of the voxels
 */

/**
 * Measures this device.
 * @param {Bench} bench
 * @param {import("./files.js").Settings} settings
 * @param {{progress: (share: number, what: string) => void, signal: AbortSignal}} watcher
 */
export async function measure(bench, settings, watcher) {
  const run = new Run(bench, await json(`${settings.truth}truth.json`), settings, watcher);
  return run.record();
}

class Run {
  #begin = performance.now();
  #leftOut = /** @type {string[]} */ ([]);

  /** @param {Bench} bench @param {Truth} truth @param {import("./files.js").Settings} settings @param {any} watcher */
  constructor(bench, truth, settings, watcher) {
    this.bench = bench;
    this.truth = truth;
    this.settings = settings;
    this.watcher = watcher;
    this.clock = new Clock({ gl: bench.gl, draw: (index) => this.#again(index), wait: bench.wait });
    this.current = { matrix: /** @type {number[]} */ ([]), step: 1 };
  }

  async record() {
    const { bench, truth, settings } = this;
    if (truth.manifest_sha256 !== settings.manifest_sha256)
      throw new Error("the truth pictures are of another package");
    const seen = /** @type {any[]} */ ([]);
    for (const [index, program] of truth.programs.entries()) seen.push(await this.#views(program, index));
    const first = await this.#nominal();
    const programs = /** @type {any[]} */ ([]);
    for (const program of truth.programs) programs.push(await this.#sweep(program));
    const sizes = /** @type {any[][]} */ ([]);
    for (const program of truth.programs) sizes.push(await this.#sizes(program));
    const last = await this.#nominal();
    const { manifest } = bench;
    const sources = manifest.channels.map((/** @type {any} */ channel) => ({
      channel: channel.name,
      sha256: channel.source.sha256,
    }));
    return {
      format: "volprep-device",
      version: "1.1",
      generator: settings.generator,
      package: {
        name: manifest.name.slice(0, 120),
        manifest_sha256: settings.manifest_sha256,
        profile: manifest.profile.name,
        step_mm: truth.step_mm,
        sources,
      },
      device: deviceNames(bench.gl),
      probes: [
        ...bench.probes.map(({ name, passed, note }) => ({ name, passed, note: (note ?? "").slice(0, 300) })),
        { name: "timer queries", passed: this.clock.kind === "timer-query", note: this.clock.note },
      ],
      picture_size: truth.picture_size,
      timing: this.clock.kind,
      programs: truth.programs.map((program, index) => ({
        program: program.program,
        transfer: program.transfer,
        level: program.level,
        views: seen[index],
        sweep_view: program.sweep_view,
        points: programs[index],
        levels: this.#levels(program),
        sizes: sizes[index],
      })),
      throttling: { first_ms: first.draw_ms, last_ms: last.draw_ms },
      left_out: this.#leftOut.slice(0, 64),
      seconds: (performance.now() - this.#begin) / 1000,
    };
  }

  /** Draws the standard views of a program. @param {TruthProgram} program @param {number} index */
  async #views(program, index) {
    await this.bench.choose(program.transfer, program.level);
    const found = [];
    for (const [number, view] of program.views.entries()) {
      const share = (index + number / program.views.length) / this.truth.programs.length;
      await this.#step(0.3 * share, `${program.transfer}, view ${view.view}`);
      if (this.#remaining() < LIMIT_MS / 2) {
        this.#leftOut.push(`views of ${program.transfer} from ${view.view} on: no time`);
        break;
      }
      this.#draw(view.box_from_clip, this.#stepOf(program));
      found.push({ view: view.view, ...errorOf(this.bench.pixels(), await this.#picture(view)) });
    }
    return found;
  }

  /** Draws, compares and times all points of a program. @param {TruthProgram} program */
  async #sweep(program) {
    const { programs } = this.truth;
    const all = programs.reduce((sum, each) => sum + each.points.length, 0);
    const before = programs.slice(0, programs.indexOf(program)).reduce((sum, each) => sum + each.points.length, 0);
    const view = program.views.find((view) => view.view === program.sweep_view);
    if (!view) return [];
    const planes = await this.#picture(view);
    const found = [];
    for (const [index, point] of program.points.entries()) {
      const done = before + index;
      await this.#step(
        0.35 + (0.6 * done) / all,
        `${program.transfer}, level ${point.level}, step ${point.step_mm.toPrecision(3)} mm`,
      );
      const budget = (this.#remaining() - KEPT_MS - SIZES_MS) / (all - done);
      if (budget < LEAST_FOR_A_POINT_MS) {
        this.#leftOut.push(
          `${program.transfer}, level ${point.level}, step ${point.step_mm.toPrecision(3)} mm: no time`,
        );
        continue;
      }
      try {
        await this.bench.choose(program.transfer, point.level);
        this.#draw(view.box_from_clip, point.step_mm);
        const error = errorOf(this.bench.pixels(), planes);
        const time = await this.clock.time(Math.min(budget, MOST_FOR_A_POINT_MS));
        if (time) found.push({ ...point, ...error, ...time });
        else
          this.#leftOut.push(
            `${program.transfer}, level ${point.level}, step ${point.step_mm.toPrecision(3)} mm: too slow to be timed more than once`,
          );
      } catch (error) {
        const { code, summary } = /** @type {any} */ (error);
        if (!code) throw error;
        this.#leftOut.push(
          `${program.transfer}, level ${point.level}, step ${point.step_mm.toPrecision(3)} mm: ${code} ${summary}`.slice(
            0,
            300,
          ),
        );
      }
    }
    return found;
  }

  /**
   * Times the nominal draw of a program in pictures of growing size: the canvas of an app has many times the pixels.
   * @param {TruthProgram} program
   */
  async #sizes(program) {
    const { bench, truth } = this;
    const view = program.views.find((view) => view.view === program.sweep_view);
    const found = /** @type {any[]} */ ([]);
    if (!view) return found;
    await bench.choose(program.transfer, program.level);
    try {
      for (const size of SIZES.map((times) => times * truth.picture_size)) {
        await this.#step(0.96, `${program.transfer}, ${size} × ${size} pixels`);
        const before = found[found.length - 1];
        const expected = before ? before.draw_ms * (size / before.size) ** 2 : 0;
        const budget = Math.min((this.#remaining() - KEPT_MS) / truth.programs.length, MOST_FOR_A_POINT_MS);
        const isLarge = size > bench.gl.getParameter(bench.gl.MAX_TEXTURE_SIZE);
        const isQuick = 2 * expected < budget && expected < MOST_FOR_A_SIZE_MS;
        const time = isQuick && !isLarge ? await this.#timeOf(view, program, size, budget) : null;
        if (!time) {
          const why = isLarge ? "more than a texture of this device" : "no time";
          this.#leftOut.push(`${program.transfer}, pictures of ${size} × ${size} pixels: ${why}`);
          break;
        }
        found.push({ size, ...time });
      }
    } finally {
      bench.resize(truth.picture_size);
    }
    return found;
  }

  /** @param {TruthView} view @param {TruthProgram} program @param {number} size @param {number} budget */
  #timeOf(view, program, size, budget) {
    this.bench.resize(size);
    this.#draw(view.box_from_clip, this.#stepOf(program));
    return this.clock.time(budget);
  }

  /** How the package holds the levels of a program. @param {TruthProgram} program */
  #levels({ transfer, level, points }) {
    const { bench } = this;
    return [...new Set([level, ...points.map((point) => point.level)])].map((index) => {
      const form = bench.form(transfer, index).slice(0, 300);
      const cost = drawingOf(bench.manifest, index, transfer)?.cost;
      return { level: index, form, upload_bytes: cost?.upload_bytes, gpu_bytes: cost?.gpu_bytes };
    });
  }

  /** Times the usual draw of the first program: at the beginning and at the end. */
  async #nominal() {
    const [program] = this.truth.programs;
    await this.bench.choose(program.transfer, program.level);
    await this.#step(0.32, "how fast a draw is");
    this.#draw(program.views[0].box_from_clip, this.#stepOf(program));
    if (this.clock.kind === "fence" && !this.#isChosen) {
      this.#isChosen = true;
      await this.clock.choose(NOMINAL_MS);
    }
    return (await this.clock.time(NOMINAL_MS)) ?? this.clock.once();
  }

  #isChosen = false;
  #pictures = /** @type {Map<string, Uint16Array>} */ (new Map());

  /** @param {TruthView} view */
  async #picture(view) {
    const kept =
      this.#pictures.get(view.file) ??
      (await truthPicture(await file(`${this.settings.truth}${view.file}`), this.truth.picture_size));
    // One for each program is needed again.
    if (this.truth.programs.some((program) => program.sweep_view === view.view)) this.#pictures.set(view.file, kept);
    return kept;
  }

  /** The package's own step at the level of a program. @param {TruthProgram} program */
  #stepOf({ transfer, level }) {
    return drawingOf(this.bench.manifest, level, transfer)?.step_mm ?? 0;
  }

  /** @param {number[]} matrix @param {number} step */
  #draw(matrix, step) {
    this.current = { matrix, step };
    this.#again(0);
  }

  /** @param {number} index */
  #again(index) {
    this.bench.draw(this.current.matrix, this.current.step, index);
  }

  #remaining() {
    return LIMIT_MS - (performance.now() - this.#begin);
  }

  /** Tells how far this is, and lets the browser show it. @param {number} share @param {string} what */
  async #step(share, what) {
    this.watcher.progress(share, what);
    await new Promise((resolve) => setTimeout(resolve));
    this.watcher.signal.throwIfAborted();
  }
}
