/** How wrong the picture is, as far as the report has measured it. */
import { make, table } from "./dom.js";
import { number, percent } from "./numbers.js";

const SAME = 1e-6;

/**
 * The measured points that are nearest to a step at a level: the same step alone, or one on each side.
 * @param {{level: number, step_mm: number}[]} points
 * @param {number} level
 * @param {number} stepMm
 */
export function nearest(points, level, stepMm) {
  const found = points.filter((point) => point.level === level).sort((a, b) => a.step_mm - b.step_mm);
  const same = found.filter((each) => Math.abs(each.step_mm / stepMm - 1) < SAME);
  if (same.length) return same.slice(0, 1);
  return [found.filter((each) => each.step_mm < stepMm).at(-1), found.find((each) => each.step_mm > stepMm)].filter(
    (value) => value !== undefined,
  );
}

/**
 * @param {any} report
 * @param {{transfer: string, level: number, step: number, edited: boolean, lit: boolean, segments: boolean, cut: boolean}} now
 */
export function accuracy(report, { transfer, level, step, edited, lit, segments, cut }) {
  const program = report.programs.find((/** @type {any} */ program) => program.transfer === transfer);
  if (!program) return [hint("The report has no measurement of this transfer function.")];
  if (lit) return [hint("You have moved the light. The report knows the package's own.")];
  if (segments) return [hint("You have shown or hidden segments. The report knows the package's own choice.")];
  if (edited) return [hint("You have changed the transfer function. The report knows the package's own.")];
  const points = program.sweep.points;
  const around = /** @type {any[]} */ (nearest(points, level, step));
  if (!around.length) return [hint(`The report has no measurement of level ${level}.`)];
  const [first, second] = around.map((each) => each.total.rmse);
  const { rmse: allowed } = report.tolerance;
  const worst = Math.max(first, second ?? 0);
  const value = second === undefined ? number(first) : `${number(Math.min(first, second))} to ${number(worst)}`;
  const meter = make("div", { className: worst > allowed ? "meter bad" : "meter" }, make("i"));
  meter.firstChild.style.width = `${Math.min(100, (100 * worst) / allowed)}%`;
  const exact = around.length === 1 && Math.abs(around[0].step_mm / step - 1) < SAME;
  const where = exact
    ? ""
    : second === undefined
      ? ` Nearest measured step: ${number(around[0].step_mm)} mm.`
      : ` Measured with steps of ${number(around[0].step_mm)} and ${number(around[1].step_mm)} mm.`;
  const rows = [...points]
    .sort((a, b) => a.level - b.level || a.step_mm - b.step_mm)
    .map((each) => [`${each.level}`, number(each.step_mm), number(each.total.rmse), number(each.total.maximum)]);
  const order = [...points].sort((a, b) => a.level - b.level || a.step_mm - b.step_mm);
  return [
    make(
      "p",
      { className: "big" },
      value,
      " ",
      make("small", {}, `RMSE against the scan itself; the scene allows ${allowed}`),
    ),
    meter,
    make(
      "p",
      { className: "hint" },
      `${percent(worst / allowed)} of the tolerance. RMSE is the usual difference of a pixel: 0 is exact, 1 is black for white.${where} Measured in the view ${program.sweep.view} by ${report.driver.renderer}.${cut ? " What is cut away was not measured." : ""}`,
    ),
    make(
      "details",
      {},
      make("summary", {}, "All measured steps and levels"),
      table("Error against truth", ["level", "step, mm", "RMSE", "largest"], rows, (index) =>
        around.includes(order[index]),
      ),
    ),
  ];
}

/** @param {string} text */
const hint = (text) => make("p", { className: "hint" }, text);
