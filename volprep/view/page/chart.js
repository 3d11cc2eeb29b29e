/** Error against time as a plot: both axes logarithmic, a curve for each level. The table beside it says the same. */
import { make, svg } from "./dom.js";
import { number } from "./numbers.js";

const WIDTH = 340;
const HEIGHT = 240;
const LEFT = 54;
const RIGHT = 10;
const TOP = 10;
const BELOW = 38;
const COLOURS = 6;
/** Largest spread of times that is not marked. */
export const STEADY = 0.1;

/**
 * @typedef {{level: number, step_mm: number, rmse: number, draw_ms: number, fastest_ms: number, slowest_ms: number}} Timed
 */

/** @param {Timed} point */
export const spread = (point) => (point.draw_ms ? (point.slowest_ms - point.fastest_ms) / point.draw_ms : 0);

/** @param {Timed[]} points @param {{tolerance: number | null, title: string}} about */
export function errorAgainstTime(points, { tolerance, title }) {
  const shown = points.filter((point) => point.draw_ms > 0 && point.rmse > 0);
  const x = scale(
    shown.flatMap((each) => [Math.max(each.fastest_ms, each.draw_ms / 4), each.slowest_ms]),
    LEFT,
    WIDTH - RIGHT,
  );
  const y = scale([...shown.map((each) => each.rmse), ...(tolerance ? [tolerance] : [])], HEIGHT - BELOW, TOP);
  const levels = [...new Set(shown.map((each) => each.level))];
  const picture = svg("svg", { class: "chart", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": title });
  picture.append(...axes(x, y));
  if (tolerance) {
    const at = y.place(tolerance);
    picture.append(
      svg("line", {
        x1: LEFT,
        x2: WIDTH - RIGHT,
        y1: at,
        y2: at,
        stroke: "var(--bad)",
        "stroke-dasharray": "2 4",
        "stroke-width": 1.5,
      }),
    );
  }
  for (const [index, level] of levels.entries()) {
    picture.append(
      ...curve(
        shown.filter((each) => each.level === level),
        `var(--series-${(index % COLOURS) + 1})`,
        x,
        y,
      ),
    );
  }
  return make("figure", { className: "figure" }, picture, legend(levels, tolerance));
}

/** @param {Timed[]} points @param {string} colour @param {Scale} x @param {Scale} y */
function curve(points, colour, x, y) {
  const sorted = [...points].sort((a, b) => b.step_mm - a.step_mm);
  const line = sorted.map((each) => `${x.place(each.draw_ms)},${y.place(each.rmse)}`).join(" ");
  const marks = sorted.flatMap((each) => {
    const [cx, cy] = [x.place(each.draw_ms), y.place(each.rmse)];
    const steady = spread(each) <= STEADY;
    const bar = svg("line", {
      x1: x.place(Math.max(each.fastest_ms, each.draw_ms / 4)),
      x2: x.place(each.slowest_ms),
      y1: cy,
      y2: cy,
      stroke: colour,
      "stroke-width": 1,
    });
    const dot = svg("circle", {
      cx,
      cy,
      r: 4,
      fill: steady ? colour : "var(--card)",
      stroke: colour,
      "stroke-width": 2,
    });
    dot.append(
      svg(
        "title",
        {},
        `level ${each.level}, step ${number(each.step_mm)} mm: ${number(each.draw_ms)} ms, RMSE ${number(each.rmse)}`,
      ),
    );
    return steady ? [dot] : [bar, dot];
  });
  return [svg("polyline", { points: line, stroke: colour }), ...marks];
}

/** @typedef {{place: (value: number) => number, ticks: number[]}} Scale */

/** @param {number[]} values @param {number} from @param {number} to @returns {Scale} */
function scale(values, from, to) {
  const logs = values.filter((value) => value > 0).map(Math.log10);
  const [low, high] = logs.length ? [Math.min(...logs), Math.max(...logs)] : [0, 1];
  const room = Math.max((high - low) * 0.08, 0.06);
  const [least, most] = [low - room, high + room];
  return {
    place: (value) => from + ((Math.log10(value) - least) / (most - least)) * (to - from),
    ticks: ticks(least, most),
  };
}

/** @param {number} least @param {number} most both logarithms */
function ticks(least, most) {
  const decades = most - least;
  const digits = decades > 3 ? [1] : decades > 1.2 ? [1, 3] : [1, 2, 3, 5, 7];
  const found = [];
  for (let power = Math.floor(least); power <= most; power++) {
    for (const digit of digits) {
      const at = power + Math.log10(digit);
      if (at >= least && at <= most) found.push(Number((digit * 10 ** power).toPrecision(2)));
    }
  }
  return found;
}

/** @param {Scale} x @param {Scale} y */
function axes(x, y) {
  const lines = [
    ...x.ticks.flatMap((value) => [
      svg("line", { class: "axis", x1: x.place(value), x2: x.place(value), y1: TOP, y2: HEIGHT - BELOW }),
      svg("text", { x: x.place(value), y: HEIGHT - BELOW + 14, "text-anchor": "middle" }, plain(value)),
    ]),
    ...y.ticks.flatMap((value) => [
      svg("line", { class: "axis", x1: LEFT, x2: WIDTH - RIGHT, y1: y.place(value), y2: y.place(value) }),
      svg("text", { x: LEFT - 5, y: y.place(value) + 4, "text-anchor": "end" }, plain(value)),
    ]),
  ];
  return [
    ...lines,
    svg(
      "text",
      { class: "label", x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - 6, "text-anchor": "middle" },
      "milliseconds for a draw",
    ),
    svg(
      "text",
      { class: "label", transform: `translate(10 ${(TOP + HEIGHT - BELOW) / 2}) rotate(-90)`, "text-anchor": "middle" },
      "RMSE against truth",
    ),
  ];
}

/** @param {number} value */
const plain = (value) => (value < 1e-4 ? number(value, 1) : String(value));

/** @param {number[]} levels @param {number | null} tolerance */
function legend(levels, tolerance) {
  const entries = levels.map((level, index) => {
    const colour = `var(--series-${(index % COLOURS) + 1})`;
    const mark = svg("svg", { viewBox: "0 0 22 12", "aria-hidden": "true" });
    mark.append(
      svg("line", { x1: 0, x2: 22, y1: 6, y2: 6, stroke: colour, "stroke-width": 2 }),
      svg("circle", { cx: 11, cy: 6, r: 4, fill: colour }),
    );
    return make("li", {}, mark, `level ${level}`);
  });
  if (tolerance) {
    const mark = svg("svg", { viewBox: "0 0 22 12", "aria-hidden": "true" });
    mark.append(
      svg("line", { x1: 0, x2: 22, y1: 6, y2: 6, stroke: "var(--bad)", "stroke-dasharray": "2 4", "stroke-width": 2 }),
    );
    entries.push(make("li", {}, mark, "what the scene allows"));
  }
  return make("ul", { className: "legend" }, ...entries);
}
