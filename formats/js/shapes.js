/** What records of a package must be like: tests of values, the shape of programs, and what breaks a shape. */

/** @typedef {(value: any) => boolean} Test */
/**
 * What a value must be: what a test finds, a list of one shape, or an object, whose "key?" may be absent.
 * @typedef {Test | ShapeList | ShapeObject} Shape
 */
/** @typedef {Shape[]} ShapeList */
/** @typedef {{[key: string]: Shape}} ShapeObject */

const SIZE = 2 ** 31 - 1;

/** @type {Test} */
export const text = (v) => typeof v === "string";
/** @type {Test} */
export const number = (v) => Number.isFinite(v);
/** @type {Test} */
export const positive = (v) => Number.isFinite(v) && v > 0;
/** @type {Test} */
export const whole = (v) => Number.isSafeInteger(v) && v >= 0;
/** @type {Test} */
export const count = (v) => Number.isSafeInteger(v) && v > 0 && v <= SIZE;
/** @type {Test} */
export const path = (v) => text(v) && /^[a-z0-9_-]+(\.[a-z0-9_-]+)*(\/[a-z0-9_-]+(\.[a-z0-9_-]+)*)*$/.test(v);
/** @param {string} words @returns {Test} */
export const among = (words) => (v) => words.split(" ").includes(v);
/** @param {number} n @param {Test} each @returns {Test} */
export const tuple = (n, each) => (v) => Array.isArray(v) && v.length === n && v.every(each);
export const three = tuple(3, number);
export const counts = tuple(3, count);

const SOURCES = "box_from_clip step_mm texture_from_box mipmap blocks_from_box block_low_mm block_high_mm split_voxel low_start_voxel low_size_voxels high_start_voxel high_size_voxels clip_from_box box_from_mesh box_from_slices slices first_sample light_mm box_from_light light_from_box picture_width picture_height";
export const UNIFORMS = [{ name: text, type: among("float vec3 mat4"), source: among(SOURCES) }];
export const PROGRAM = {
  name: text,
  sampling: among("texture3d mosaic subvolumes bricks"),
  "technique?": text,
  "classification?": text,
  "compositing?": text,
  "rays?": among("box mesh"),
  vertex: path,
  fragment: path,
  levels: [whole],
  transfer: text,
  uniforms: UNIFORMS,
  samplers: [{ name: text, role: among("volume bricks transfer preintegrated skip normals subvolume"), "transfer?": text, "part?": whole }],
  "step_mm_min?": number,
};

/**
 * What breaks the shape first, or nothing.
 * @param {any} value @param {Shape} shape @param {string} at
 * @returns {string | undefined}
 */
export function breach(value, shape, at) {
  if (typeof shape === "function") return shape(value) ? undefined : `${at || "the whole"} is missing or of the wrong kind`;
  if (Array.isArray(shape)) {
    if (!Array.isArray(value)) return `${at} is no list`;
    for (let i = 0; i < value.length; i++) {
      const found = breach(value[i], shape[0], `${at}[${i}]`);
      if (found) return found;
    }
    return undefined;
  }
  if (typeof value !== "object" || value === null || Array.isArray(value)) return `${at || "the whole"} is no object`;
  for (const [key, inner] of Object.entries(shape)) {
    const name = key.replace("?", "");
    if (!Object.hasOwn(value, name) && name !== key) continue;
    const found = breach(Object.hasOwn(value, name) ? value[name] : undefined, inner, at ? `${at}.${name}` : name);
    if (found) return found;
  }
  return undefined;
}

/** A file, and the role in which it is used. @typedef {[file: string, role: string]} Use */

/** Passes beside a picture's own, each with a texture that the program reads. @param {Pick<import("./types.js").Program, "before" | "light_pass">} program */
export const passesOf = ({ before = [], light_pass: light }) => (light ? [...before, light] : before);

/** Files of programs and of their passes. @param {import("./types.js").Program[]} programs @returns {Use[]} */
export const shadersOf = (programs) => programs.flatMap((each) => [each, ...passesOf(each)].flatMap(({ vertex, fragment }) => /** @type {Use[]} */ ([[vertex, "shader"], [fragment, "shader"]])));
