/**
 * How long a draw takes. Frames are locked to the display and most phones have no timer queries, so that many draws are
 * made before one wait, and the time of a draw is the slope of time over their number. The wait is to read one pixel:
 * WebGL 1 has no fences, WebGL 2 checks its fences only between tasks, and `finish` waits for nothing in browsers.
 */

const REPEATS = 5;
const BURST_MS = 40;
const MOST_DRAWS = 256;
/** Where one draw takes longer than this, the wait, well below a millisecond, does not matter beside it. */
const LONG_MS = 60;
const AGREEMENT = 2;

/**
 * @typedef {object} Drawer
 * @property {WebGLRenderingContext | WebGL2RenderingContext} gl
 * @property {(index: number) => void} draw draws once, each time into the other of two targets: a tile-based GPU skips
 *   pictures that are drawn over in the same target, and would be timed as if it drew the last one alone
 * @property {() => void} wait returns when everything has been drawn
 *
 * @typedef {{draw_ms: number, fastest_ms: number, slowest_ms: number, draws: number}} Time
 */

/** Times draws within a budget. */
export class Clock {
  #drawer;
  #query;

  /** @param {Drawer} drawer */
  constructor(drawer) {
    this.#drawer = drawer;
    this.#query = queryOf(drawer.gl);
    /** Method that times the draws. @type {"timer-query" | "fence"} */
    this.kind = "fence";
    /** Result of trying timer queries, in words. */
    this.note = this.#query ? "" : "this browser has none";
  }

  /**
   * Takes timer queries if this device has them and they agree with waiting.
   * Call it when the draw that is timed is the usual one.
   * @param {number} budgetMs
   */
  async choose(budgetMs) {
    if (!this.#query) return;
    const waited = this.#byWaiting(budgetMs / 2) ?? this.once();
    const queried = await this.#byQuery(budgetMs / 2);
    if (queried === null) {
      this.note = "they give no result";
      return;
    }
    const ratio = queried.draw_ms / waited.draw_ms;
    const agrees = ratio < AGREEMENT && ratio > 1 / AGREEMENT;
    this.note = `${queried.draw_ms.toPrecision(3)} ms for a draw, and ${waited.draw_ms.toPrecision(3)} ms by waiting`;
    if (agrees) this.kind = "timer-query";
  }

  /**
   * The time of a draw: median, fastest and slowest of a few; null if it is so long that it cannot be taken twice.
   * @param {number} budgetMs about how long this may take
   * @returns {Promise<Time | null>}
   */
  async time(budgetMs) {
    const queried = this.kind === "timer-query" ? await this.#byQuery(budgetMs) : null;
    return queried ?? this.#byWaiting(budgetMs);
  }

  /** The time of a single draw. @returns {Time} */
  once() {
    return summary([this.#burst(1)], 1);
  }

  /** @param {number} count */
  #burst(count) {
    const { draw, wait } = this.#drawer;
    const begin = performance.now();
    for (let index = 0; index < count; index++) draw(index);
    wait();
    return performance.now() - begin;
  }

  /** @param {number} budgetMs @returns {Time | null} */
  #byWaiting(budgetMs) {
    const one = Math.max(this.#burst(1), 0.01);
    if (one > LONG_MS) {
      if (2 * one > budgetMs) return null;
      const repeats = within(budgetMs / one, 2, REPEATS);
      return summary(
        Array.from({ length: repeats }, () => this.#burst(1)),
        repeats,
      );
    }
    let most = 3;
    while (most < MOST_DRAWS && this.#burst(most) < BURST_MS) most *= 2;
    most = Math.min(most, MOST_DRAWS);
    const counts = [Math.ceil(most / 3), Math.ceil((2 * most) / 3), most];
    const begin = performance.now();
    const slopes = [
      slope(
        counts,
        counts.map((count) => this.#burst(count)),
      ),
    ];
    const repeats = within(budgetMs / (performance.now() - begin), 3, REPEATS);
    while (slopes.length < repeats)
      slopes.push(
        slope(
          counts,
          counts.map((count) => this.#burst(count)),
        ),
      );
    // A line that does not rise is a burst that something else held up: it says nothing of a draw.
    const rising = slopes.filter((slope) => slope > 0);
    return summary(rising.length ? rising : slopes, repeats * counts.reduce((sum, each) => sum + each, 0));
  }

  /** @param {number} budgetMs @returns {Promise<Time | null>} null where the GPU was disturbed, or says nothing */
  async #byQuery(budgetMs) {
    const query = /** @type {Query} */ (this.#query);
    const { draw } = this.#drawer;
    const one = Math.max(this.#burst(1), 0.01);
    const count = within(Math.min(BURST_MS, budgetMs / REPEATS) / one, 1, MOST_DRAWS);
    const times = [];
    for (let repeat = 0; repeat < REPEATS; repeat++) {
      const ms = await query(() => {
        for (let index = 0; index < count; index++) draw(index);
      });
      if (ms === null || !(ms > 0)) return null;
      times.push(ms / count);
    }
    return summary(times, count * REPEATS);
  }
}

/** @param {number} value @param {number} least @param {number} most */
const within = (value, least, most) => Math.min(most, Math.max(least, Math.floor(value)));

/** The slope of a line through points, least squares. @param {number[]} counts @param {number[]} times */
export function slope(counts, times) {
  const mean = (/** @type {number[]} */ values) => values.reduce((sum, each) => sum + each, 0) / values.length;
  const [n, t] = [mean(counts), mean(times)];
  const above = counts.reduce((sum, each, index) => sum + (each - n) * (times[index] - t), 0);
  const below = counts.reduce((sum, each) => sum + (each - n) ** 2, 0);
  return Math.max(0, above / below);
}

/** @param {number[]} times @param {number} draws @returns {Time} */
function summary(times, draws) {
  const sorted = [...times].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  const draw_ms = sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
  return { draw_ms, fastest_ms: sorted[0], slowest_ms: sorted[sorted.length - 1], draws };
}

/** @typedef {(work: () => void) => Promise<number | null>} Query the milliseconds that the GPU works; null if unknown */

/** Timer queries of this context; null where it has none. @param {any} gl @returns {Query | null} */
function queryOf(gl) {
  const two = gl.getExtension("EXT_disjoint_timer_query_webgl2");
  const one = two ? null : gl.getExtension("EXT_disjoint_timer_query");
  const extension = two ?? one;
  if (!extension) return null;
  const elapsed = extension.TIME_ELAPSED_EXT;
  return async (work) => {
    gl.getParameter(extension.GPU_DISJOINT_EXT); // clears earlier interruptions
    const query = two ? gl.createQuery() : one.createQueryEXT();
    if (two) gl.beginQuery(elapsed, query);
    else one.beginQueryEXT(elapsed, query);
    work();
    if (two) gl.endQuery(elapsed);
    else one.endQueryEXT(elapsed);
    gl.flush();
    const result = await resultOf(gl, two, one, query);
    if (two) gl.deleteQuery(query);
    else one.deleteQueryEXT(query);
    return gl.getParameter(extension.GPU_DISJOINT_EXT) ? null : result;
  };
}

/** @param {any} gl @param {any} two @param {any} one @param {any} query */
async function resultOf(gl, two, one, query) {
  const end = performance.now() + 3000;
  while (performance.now() < end) {
    await new Promise((resolve) => setTimeout(resolve, 2));
    const there = two
      ? gl.getQueryParameter(query, gl.QUERY_RESULT_AVAILABLE)
      : one.getQueryObjectEXT(query, one.QUERY_RESULT_AVAILABLE_EXT);
    if (there) {
      const nanoseconds = two
        ? gl.getQueryParameter(query, gl.QUERY_RESULT)
        : one.getQueryObjectEXT(query, one.QUERY_RESULT_EXT);
      return nanoseconds / 1e6;
    }
  }
  return null;
}
