/** In which format a texture reaches this device: its own if that works here, else the nearest that does, else none. */
import { checkedFormat } from "../core/drawing.js";
import { VolpkgError } from "../core/error.js";
import { FORMATS } from "./formats.js";

/** @typedef {import("./probe.js").Probes} Probes */
/** @typedef {import("./probe.js").Want} Want */
/** @typedef {import("./textures.js").Form} Form */
/** @typedef {import("../core/types.js").Texture} Texture */
/** Draws a few texels of each. @typedef {(wants: Want[]) => void} Test */

/** The capability that a texture in this form needs. @param {Texture} texture @param {Form} form @returns {Want} */
const wantOf = (texture, form) => ({
  internal: form.internal,
  volume: texture.gl.target === "TEXTURE_3D",
  // A texture that must be filtered needs a format that the device filters.
  nearest: texture.filter === "nearest" || form.finer !== undefined,
});

/** Sizes along an axis that some devices accept and then draw black. @param {Texture} texture @returns {Want[]} */
function sizes({ gl, shape_zyx: [z, y, x] }) {
  const volume = gl.target === "TEXTURE_3D";
  const internal = FORMATS[gl.internal_format].format === "LUMINANCE" || !volume ? "RGBA" : "R8";
  return [x, y, z].flatMap((size, axis) => (size > 256 ? [{ internal, volume, nearest: true, size, axis }] : []));
}

/**
 * The form of each texture on this device. Other formats are tried only if a texture's own format does not work. Throws
 * VP7014 if no format works.
 * @param {Probes} probes
 * @param {Test} test
 * @param {Texture[]} textures
 * @returns {Promise<Form[]>}
 */
export async function formsOf(probes, test, textures) {
  const own = textures.map((texture) => ({ internal: checkedFormat(texture) }));
  test(textures.flatMap((texture, i) => [wantOf(texture, own[i]), ...sizes(texture)]));
  return Promise.all(textures.map((texture, i) => formOf(probes, test, texture, own[i])));
}

/** @param {Probes} probes @param {Test} test @param {Texture} texture @param {Form} own @returns {Promise<Form>} */
async function formOf(probes, test, texture, own) {
  const size = sizes(texture).find((want) => !probes.result(want).works);
  const first = probes.result(size ?? wantOf(texture, own));
  if (first.works) return own;
  const format = size ? `${size.size} texels along an axis` : own.internal;
  const refused = new VolpkgError("VP7014", { ...first, format: `${format} (${texture.name})` });
  if (size) throw refused;
  const { others } = await import("./fallbacks.js");
  const found = others(texture).find((form) => {
    test([wantOf(texture, form)]);
    return probes.result(wantOf(texture, form)).works;
  });
  if (!found) throw refused;
  return found;
}
