/** Shapes of records that only few packages have, and of programs and their passes. */

/** @typedef {(value: any) => boolean} Test */
/**
 * The form of a value: a test, a list of one shape, or an object, whose "key?" may be absent.
 * @typedef {Test | ShapeList | ShapeObject} Shape
 */
/** @typedef {Shape[]} ShapeList */
/** @typedef {{[key: string]: Shape}} ShapeObject */

const SIZE = 2 ** 31 - 1;

/** Whether an object has a key of its own; Object.hasOwn needs Safari 15.4. @param {object} value @param {string} key */
// biome-ignore lint/suspicious/noPrototypeBuiltins: Object.hasOwn needs Safari 15.4
export const has = (value, key) => Object.prototype.hasOwnProperty.call(value, key);

/** @type {Test} */
export const text = (v) => typeof v === "string";
/** @type {Test} */
export const count = (v) => Number.isSafeInteger(v) && v > 0 && v <= SIZE;
/** @param {string} words @returns {Test} */
export const among = (words) => (v) => words.split(" ").includes(v);
/** @param {number} n @param {Test} each @returns {Test} */
export const tuple = (n, each) => (v) => Array.isArray(v) && v.length === n && v.every(each);

/**
 * The first violation of a shape, or undefined.
 * @param {any} value @param {Shape} shape @param {string} at
 * @returns {string | undefined}
 */
export function breach(value, shape, at) {
  if (typeof shape === "function")
    return shape(value) ? undefined : `${at || "the whole"} is missing or of the wrong kind`;
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
    if (!has(value, name) && name !== key) continue;
    const found = breach(has(value, name) ? value[name] : undefined, inner, at ? `${at}.${name}` : name);
    if (found) return found;
  }
  return undefined;
}

/** A file, and the role in which it is used. @typedef {[file: string, role: string]} Use */

/** Passes beside a picture's own, each with a texture that the program reads. @param {Pick<import("./types.js").Program, "before" | "light_pass">} program */
export const passesOf = ({ before = [], light_pass: light }) => (light ? [...before, light] : before);

/** Files of programs and of their passes. @param {import("./types.js").Program[]} programs @returns {Use[]} */
export const shadersOf = (programs) =>
  programs.flatMap((program) =>
    [program, ...passesOf(program)].flatMap(
      ({ vertex, fragment }) =>
        /** @type {Use[]} */ ([
          [vertex, "shader"],
          [fragment, "shader"],
        ]),
    ),
  );
