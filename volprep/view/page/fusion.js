/** Slices of channels on several grids: the colours of the others over the grey of the first one. */
import { encodedOf } from "../runtime/slices.js";

/** Opacity in a slice where a channel absorbs most. */
const MOST = 0.75;

/** @typedef {import("../runtime/slices.js").Slice} Slice */
/** @typedef {{value: number, colour: number[], extinction_per_mm: number}} Point */
/** @typedef {{points: Point[], lines: boolean, opacity: number, slice: Slice}} Veil a channel over the first one */

/** Channels of a picture with their functions, if they lie on several grids. @param {any} manifest @param {string} name */
export function mediaOf(manifest, name) {
  const picture = manifest.pictures.find((/** @type {any} */ shown) => shown.name === name);
  const media = picture?.grid ? picture.media : [];
  return /** @type {{channel: string, transfer: string}[]} */ (media.length > 1 ? media : []);
}

/**
 * Reads the values of all channels but the first on a plane.
 * @param {import("../runtime/renderer.js").Renderer} renderer @param {import("../runtime/slices.js").SliceOptions} where
 */
export async function veilsOf(renderer, where) {
  const { manifest } = renderer.package;
  /** @type {Veil[]} */
  const veils = [];
  for (const [medium, { channel, transfer }] of mediaOf(manifest, renderer.program).entries()) {
    const slice = medium ? await renderer.slice({ ...where, medium }) : null;
    if (!slice) continue;
    const { transfer_functions: functions, source } = /** @type {any} */ (
      manifest.channels.find(({ name }) => name === channel)
    );
    const { points } = functions.find((/** @type {any} */ own) => own.name === transfer);
    const values = renderer.inside?.drawn.choice.values ?? {};
    const [opacity] = [values[`opacity_of_medium_${medium}`]].flat();
    veils.push({ points, lines: source.info.unit === "Gy", opacity: Number(opacity ?? 1), slice });
  }
  return veils;
}

/**
 * Lays channels over the pixels of `grey`; of a dose it also draws a line at the value of each point of its function.
 * @param {Uint8ClampedArray<ArrayBuffer>} pixels @param {Veil[]} veils
 */
export function fuse(pixels, veils) {
  for (const { points, lines, opacity, slice } of veils) {
    const most = Math.max(...points.map((point) => point.extinction_per_mm), 1e-9);
    slice.values.forEach((value, i) => {
      if (Number.isNaN(value)) return;
      const { colour, extinction } = at(points, value);
      const isodose = lines && points.some((point) => point.extinction_per_mm > 0 && isLine(slice, i, point.value));
      const alpha = Math.min(1, opacity * (isodose ? 1 : (MOST * extinction) / most));
      for (const [c, light] of colour.entries())
        pixels[4 * i + c] += alpha * (255 * encodedOf(light) - pixels[4 * i + c]);
      pixels[4 * i + 3] = Math.max(pixels[4 * i + 3], 255 * alpha);
    });
  }
  return pixels;
}

/** Whether a pixel is within, and a neighbour without. @param {Slice} slice @param {number} i @param {number} threshold */
function isLine({ values, width }, i, threshold) {
  const beside = [i % width ? values[i - 1] : NaN, (i + 1) % width ? values[i + 1] : NaN];
  return values[i] >= threshold && [...beside, values[i - width], values[i + width]].some((value) => value < threshold);
}

/** Colour and extinction of a value. @param {Point[]} points @param {number} value */
function at(points, value) {
  const behind = points.findIndex((point) => point.value > value);
  const [a, b] = [points[behind > 0 ? behind - 1 : behind ? points.length - 1 : 0], points.at(behind) ?? points[0]];
  const share = behind > 0 ? (value - a.value) / (b.value - a.value) : 0;
  const colour = a.colour.map((light, c) => light + share * (b.colour[c] - light));
  return { colour, extinction: a.extinction_per_mm + share * (b.extinction_per_mm - a.extinction_per_mm) };
}
