/** Values of the volume at places. The package's own shader reads them, from whatever textures it has. */
import { bind } from "../core/load.js";
import { WHOLE } from "../gl/program.js";

/** @typedef {import("../gl/formats.js").Gl} Gl */
/** @typedef {import("../gl/program.js").Linked} Linked */
/** @typedef {import("../core/renderer.js").Renderer} Renderer */

const VERTEX = "#version 300 es\nin vec2 a_ndc;\nvoid main() {\n  gl_Position = vec4(a_ndc, 0.0, 1.0);\n}\n";
const MAIN = "void main() {";
/** A value from 0 to 1, in three digits to the base 255. */
const DIGITS = `  vec3 digits = fract(clamp(value, 0.0, 0.9999999) * vec3(1.0, 255.0, 65025.0));
  PICTURE = vec4(digits.xy - digits.yz / 255.0, digits.z, inside);
}
`;

/**
 * A program like that which draws, with another main function.
 * @param {Renderer} renderer
 * @param {string} kind of main function, for caches
 * @param {string} main declares uniforms, and begins a main function that sets `value` and `inside`, both floats
 * @param {string} [reads] the function of the shader that it reads values with
 * @returns {Promise<Linked | null>} null if the shader reads no values
 */
export async function valueProgram(renderer, kind, main, reads = "stored_value") {
  const { inside } = renderer;
  if (!inside) return null;
  const { pack, device, drawn } = inside;
  const { name, fragment: path } = drawn.choice.program;
  const fragment = await pack.text(path);
  const [before] = fragment.split(MAIN);
  if (!before.includes(`float ${reads}(vec3`) || !/\bvec3 position\(vec3/.test(before)) return null;
  const modern = fragment.startsWith("#version 300 es");
  // The output of the vertex shader is not used.
  const alone = before.replace(/^(?:varying|in) (?=\w+ \w+;$)/gm, "");
  // With voxels of hidden segments left out, the value that is drawn is another than the scan's.
  const own = /\bfloat scan_value\(vec3/.test(before) ? main.replace("stored_value", "scan_value") : main;
  const text = `${alone}${own}${DIGITS.replace("PICTURE", modern ? "picture" : "gl_FragColor")}`;
  const texts = { name: `${name} ${kind}`, vertex: modern ? VERTEX : WHOLE, fragment: text };
  return device.linked(texts.name, async () => texts);
}

/**
 * Draws values into a picture of 8 bits, and reads it.
 * @param {Renderer} renderer @param {Linked} linked @param {readonly [number, number]} size in pixels
 * @param {(gl: Gl, linked: Linked) => void} draw sets the remaining uniforms and draws triangles
 * @returns {Uint8Array} four bytes for each pixel
 */
export function drawValues(renderer, linked, [width, height], draw) {
  const { gl, device, drawn, last } = /** @type {NonNullable<Renderer["inside"]>} */ (renderer.inside);
  const { choice } = drawn;
  const pixels = new Uint8Array(4 * width * height);
  renderer.use(() => {
    const texture = gl.createTexture();
    const frame = gl.createFramebuffer();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.viewport(0, 0, width, height);
    device.state(false);
    const uniforms = choice.program.uniforms.filter(({ name }) => linked.locations[name]);
    const inputs = { ...choice.program, uniforms, before: [], light_pass: undefined };
    const behind = { planes: [], pixel: [1, 1], boxFromClip: last?.boxFromClip ?? [] };
    bind(gl, { ...drawn, clip: null }, linked, inputs, choice.values, behind);
    device.triangle();
    draw(gl, linked);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(frame);
    gl.deleteTexture(texture);
    device.unbind();
  });
  return pixels;
}

/** The value of a pixel, from 0 to 1. @param {Uint8Array} pixels @param {number} i index of the pixel */
export const valueOf = (pixels, i) => pixels[4 * i] / 255 + pixels[4 * i + 1] / 255 ** 2 + pixels[4 * i + 2] / 255 ** 3;

/**
 * Line of a shader that sets `value` to the label of a voxel, in 65536ths.
 * @param {Renderer} renderer @param {string} place in box millimetres
 */
export function labelLine({ inside }, place) {
  const { program, textures = [] } = inside?.drawn.choice ?? {};
  // Bricks have positions in voxels, and labels, in a 3D texture of their own, have not.
  const solid = textures.some(({ role, gl }) => role === "labels" && gl.target === "TEXTURE_3D");
  const size = program?.sampling === "bricks" && solid ? " / vec3(textureSize(u_labels, 0))" : "";
  return `  float value = (label_of(position(${place})${size}) + 0.5) / 65536.0;\n`;
}

/** The label of a pixel that such a line has drawn. @param {Uint8Array} pixels @param {number} i index of the pixel */
export const labelOf = (pixels, i) => Math.floor(valueOf(pixels, i) * 65536);

/** Channels of the picture with their transfer functions, if they lie on several grids. @param {Renderer} renderer */
export function mediaOnGrids({ inside }) {
  const picture = inside?.pack.manifest.pictures.find(({ name }) => name === inside.drawn.choice.picture);
  return picture?.grid && picture.media.length > 1 ? picture.media : [];
}

/**
 * Lines of a shader that set `value` to that of one of several media on grids of their own, where it has one.
 * @param {number} medium @param {string} place in box millimetres
 */
export const mediumLines = (medium, place) =>
  `  begin_K(position(${place}), vec3(1.0, 0.0, 0.0));
  inside *= within_K.x <= 0.0 && within_K.y >= 0.0 ? 1.0 : 0.0;
  float value = stored_value_K(start_K);
`.replaceAll("_K", `_${medium}`);

/** The segments that the renderer's program draws, or null. @param {Renderer} renderer */
export function segmentsOf({ inside }) {
  const { segments } = inside?.pack.manifest ?? {};
  return segments && inside?.drawn.choice.picture === segments.name ? segments : null;
}

/**
 * The scan's values of texels 0 and 1.
 * @param {Renderer} renderer @param {string} [of] transfer function; that of the picture if absent
 * @returns {readonly [number, number]}
 */
export function windowOf(renderer, of) {
  const { inside } = renderer;
  const transfer = of ?? segmentsOf(renderer)?.transfers[0] ?? inside?.drawn.choice.picture;
  const channel = inside?.pack.manifest.channels.find((channel) =>
    channel.transfer_functions.some(({ name }) => name === transfer),
  );
  return channel?.quantization.window ?? [0, 1];
}
