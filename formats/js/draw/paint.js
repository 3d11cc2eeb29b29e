/** Draws one picture with a loaded level. spec/webgl.md. */
import { bind } from "../core/load.js";

/** @typedef {import("../core/drawing.js").Value} Value */
/** @typedef {import("../gl/formats.js").Gl} Gl */
/**
 * @typedef {object} Painting
 * @property {ArrayLike<number>} boxFromClip
 * @property {import("../core/options.js").Viewport} viewport
 * @property {WebGLFramebuffer | null | undefined} target in place of the picture
 * @property {import("../gl/target.js").Picture} picture
 * @property {number} scale share of the pixels of the picture along an axis
 * @property {import("../gl/mesh.js").Mesh | null} mesh where rays may begin and end
 * @property {Pick<import("./clip.js").Behind, "texture" | "reversed" | "scale" | "planes">} behind
 * @property {Record<string, Value>} values by the source of a uniform
 * @property {boolean} blend with the existing picture
 * @property {import("../core/options.js").Viewport} [part] of the picture, which is drawn
 */

/**
 * @param {Gl} gl @param {import("../gl/device.js").Device} device @param {import("../core/load.js").Drawn} drawn
 * @param {Painting} how
 */
export function paint(gl, device, drawn, how) {
  const { boxFromClip, viewport, target, picture, scale, values, blend, part } = how;
  const [x, y, width, height] = viewport;
  const own = target === undefined;
  const mesh = how.mesh?.front(boxFromClip);
  const bindTarget = () => {
    if (own) picture.bind(Math.ceil(width * scale), Math.ceil(height * scale));
    else gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  };
  bindTarget();
  const size = own ? [picture.width, picture.height] : [width, height];
  const place = /** @type {const} */ ([own ? 0 : x, own ? 0 : y, size[0], size[1]]);
  gl.viewport(...place);
  device.state(blend);
  const behind = { ...how.behind, pixel: size, boxFromClip };
  const give = (/** @type {any} */ to, /** @type {any} */ inputs, /** @type {any} */ all) =>
    bind(gl, drawn, to, inputs, all, behind);
  const { choice } = drawn;
  const { linked, technique } = mesh ?? drawn;
  const all = mesh ? { ...values, ...mesh.values } : values;
  if (technique) technique.draw(linked, { values: all, viewport: place, bindTarget, bind: give, part });
  else {
    give(linked, choice.program, values);
    device.triangle();
    if (part) {
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(...part);
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
  }
  device.unbind();
}
