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
 * @property {"whole" | "cut" | "edited" | "occlusion" | null} light whose precomputed light is drawn: that of the whole
 *   or the cut volume; of an edited function none, or occlusion that was computed again
 * @property {import("../on_demand.js").BrickState} [bricks] of a picture from bricks on demand: the missing ones, and the
 *   bound of what that changes
 * @property {string[]} differs why this picture is another one than that which was judged
 */

const SAME = 1e-6;
/** Whose precomputed light is drawn, if the function was edited or the volume cut. */
const LIGHTS = {
  edited: "light: of another function, so that it is left out",
  occlusion: "light: occlusion of the edited function, computed on this device",
  cut: "light: of the cut volume",
  whole: "light: of the uncut volume",
};

/**
 * The drawing of a level of the picture with this name, or of the first one; of a time series that of the first frame.
 * @param {import("./types.js").Manifest} manifest @param {number} level @param {string} [name]
 */
export function drawingOf({ pictures }, level, name = pictures[0].name) {
  return pictures.find((picture) => picture.name === name)?.drawings.find((drawing) => drawing.level === level);
}

/** @param {Renderer} renderer @param {Measured} [measured] @returns {Fidelity | null} null if nothing was drawn */
export function fidelityOf(renderer, measured) {
  const { inside, program, level } = renderer;
  if (!inside?.last) return null;
  const { pack, drawn, last, changed } = inside;
  const { scale, step } = last.quality;
  const stepMm = renderer.step * step;
  const points = (measured?.programs ?? []).filter((each) => each.transfer === program).flatMap((each) => each.points);
  const nearest = near(
    points.filter((point) => point.level === level),
    stepMm,
  );
  const stated = drawingOf(pack.manifest, level, program)?.fidelity;
  const found = nearest ?? stated;
  const judged = nearest ? nearest.step_mm : renderer.packageStep;
  const light = bakedLight(drawn.choice, changed.edited);
  const differs = [
    changed.edited && "the transfer function was edited",
    light && (changed.edited || changed.cut) && LIGHTS[light],
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
    texels: [...new Set(drawn.choice.textures.map(({ format }) => format))],
    source: nearest ? "measured" : stated ? "stated" : "unknown",
    rmse: value(nearest ? nearest.seen_rmse : stated?.rmse),
    maximum: value(found?.maximum),
    kept_light: value(nearest?.kept_light),
    light,
    ...(drawn.choice.bricks && { bricks: drawn.choice.bricks.state }),
    differs: differs.filter((differ) => typeof differ === "string"),
  };
}

/**
 * Whose precomputed light is drawn; null for a picture without such light.
 * @param {import("./drawing.js").Choice} choice @param {boolean} edited
 * @returns {keyof typeof LIGHTS | null}
 */
function bakedLight({ textures, relit }, edited) {
  const lit = textures.find((texture) => texture.light);
  if (!lit) return null;
  if (edited) return relit ? "occlusion" : "edited";
  return lit.light?.planes?.length ? "cut" : "whole";
}

/** A record as one line of text. @param {Fidelity} record */
export function words({ program, level, step_mm: step, source, rmse, kept_light: kept, bricks, differs }) {
  const short = (/** @type {number} */ each) => String(Number(each.toPrecision(2)));
  const what = `${program}, level ${level}, step ${short(step)} mm`;
  if (bricks) return `${program}, step ${short(step)} mm: ${brickWords(bricks)}`;
  if (rmse === null) return `${what}: the error against the scan is not known.`;
  const light = kept === null ? "" : `, ${Math.round(100 * kept)} % of the light of thin structures`;
  const where = source === "measured" ? "measured on this device" : "stated by the package";
  const but = differs.length ? ` This picture is another: ${differs.join("; ")}.` : "";
  return `${what}: error ${short(rmse)} against the scan (RMSE, 0 to 1)${light}; ${where}.${but}`;
}

/** How near a picture from bricks is. @param {import("../on_demand.js").BrickState} state */
function brickWords({ bound, missing, missingBytes, damaged }) {
  const broken = damaged ? ` ${damaged} bricks are damaged.` : "";
  const near = `within ${bound < 0.001 ? "0.001" : bound.toPrecision(2)} of the picture of all bricks (RMSE, 0 to 1)`;
  if (!missing) return `${near}.${broken}`;
  return `${near}: ${missing} bricks are missing, ${(missingBytes / 1e6).toPrecision(2)} MB.${broken}`;
}

/** The point of the nearest step, as a ratio. @param {Point[]} points @param {number} stepMm */
function near(points, stepMm) {
  const ratio = (/** @type {Point} */ each) => Math.abs(Math.log(each.step_mm / stepMm));
  return points.reduce(
    (/** @type {Point | undefined} */ best, each) => (best && ratio(best) <= ratio(each) ? best : each),
    undefined,
  );
}
