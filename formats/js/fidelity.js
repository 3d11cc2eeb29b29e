/** The known error of the picture on the screen against the scan. */

/** @typedef {import("./renderer.js").Renderer} Renderer */
/**
 * A measurement of a device, as `volprep view` makes it.
 * @typedef {{programs: {transfer: string, points: Point[]}[]}} Measured
 */
/** @typedef {{level: number, step_mm: number, seen_rmse: number, maximum: number, kept_light?: number}} Point */
/**
 * The record. Where nothing is known of a number it is null.
 * @typedef {object} Fidelity
 * @property {"volpkg-fidelity"} format
 * @property {1} version
 * @property {string} package
 * @property {string} program
 * @property {number} level
 * @property {number} step_mm distance of samples of this picture
 * @property {number} pixels_scale share of the pixels along an axis that were drawn; the others are interpolated
 * @property {string[]} texels formats of the textures on this device
 * @property {"measured" | "stated" | "unknown"} source on this device; by the package; or not at all
 * @property {number | null} rmse root mean square error over visible pixels, premultiplied linear light
 * @property {number | null} maximum no channel of a pixel is expected to be further off
 * @property {number | null} kept_light share of the light of thin structures that is kept
 * @property {string[]} differs why this picture is another one than that which was judged
 */

const SAME = 1e-6;

/** @param {Renderer} renderer @param {Measured} [measured] @returns {Fidelity | null} null if nothing was drawn */
export function fidelityOf(renderer, measured) {
  const { inside, program, level } = renderer;
  if (!inside?.last) return null;
  const { pack, drawn, last, changed } = inside;
  const { scale, step } = last.quality;
  const stepMm = renderer.step * step;
  const points = (measured?.programs ?? []).filter((each) => each.transfer === program).flatMap((each) => each.points);
  const nearest = near(
    points.filter((each) => each.level === level),
    stepMm,
  );
  const entries = /** @type {any} */ (pack.manifest).fidelity;
  const stated = (Array.isArray(entries) ? entries : []).find(
    (each) => each?.transfer === program && each.level === level,
  );
  const found = nearest ?? stated;
  const judged = nearest ? nearest.step_mm : renderer.packageStep;
  const isBaked = drawn.choice.program.samplers.some(({ role }) => role === "light");
  const differs = [
    changed.edited && "the transfer function was edited",
    changed.edited && isBaked && "light: of another function, so that it is left out",
    changed.cut && "a part is cut away",
    changed.lit && "the light was moved",
    scale < 1 && "fewer pixels are drawn while the camera moves",
    found && Math.abs(stepMm / judged - 1) > SAME && `it was judged with a step of ${judged} mm`,
  ];
  const value = (/** @type {unknown} */ one) => (Number.isFinite(one) ? /** @type {number} */ (one) : null);
  return {
    format: "volpkg-fidelity",
    version: 1,
    package: pack.name,
    program,
    level,
    step_mm: stepMm,
    pixels_scale: scale,
    texels: [...new Set(drawn.choice.textures.map(({ gl }) => gl.internal_format))],
    source: nearest ? "measured" : stated ? "stated" : "unknown",
    rmse: value(nearest ? nearest.seen_rmse : stated?.rmse),
    maximum: value(found?.maximum),
    kept_light: value(found?.kept_light),
    differs: differs.filter((each) => typeof each === "string"),
  };
}

/** A record as one line of text. @param {Fidelity} record */
export function words({ program, level, step_mm: step, source, rmse, kept_light: kept, differs }) {
  const short = (/** @type {number} */ each) => String(Number(each.toPrecision(2)));
  const what = `${program}, level ${level}, step ${short(step)} mm`;
  if (rmse === null) return `${what}: the error against the scan is not known.`;
  const light = kept === null ? "" : `, ${Math.round(100 * kept)} % of the light of thin structures`;
  const where = source === "measured" ? "measured on this device" : "stated by the package";
  const but = differs.length ? ` This picture is another: ${differs.join("; ")}.` : "";
  return `${what}: error ${short(rmse)} against the scan (RMSE, 0 to 1)${light}; ${where}.${but}`;
}

/** The point of the nearest step, as a ratio. @param {Point[]} points @param {number} stepMm */
function near(points, stepMm) {
  const ratio = (/** @type {Point} */ each) => Math.abs(Math.log(each.step_mm / stepMm));
  return points.reduce(
    (/** @type {Point | undefined} */ best, each) => (best && ratio(best) <= ratio(each) ? best : each),
    undefined,
  );
}
