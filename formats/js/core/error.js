/**
 * Messages of this reader: the codes and the words of the catalogue of volprep, which a test compares. `messages.js` adds those
 * of parts that few packages need.
 */

/** @type {Record<string, [summary: string, remedy: string]>} */
export const WORDS = {
  VP4001: ["{path}: no such package", "Check the path."],
  VP4002: [
    "{path}: not a volume package: {problem}",
    "Name the folder that volprep build wrote, or the file of volprep zip.",
  ],
  VP4007: ["{path}: cannot read {file}: {error}", "Copy the package again, or build it again."],
  VP4008: ["{path}: {file} has {size} bytes instead of {expected}", "Copy the package again, or build it again."],
  VP4009: [
    "{path}: {file} is damaged: its SHA-256 is not the one in the manifest",
    "Copy the package again, or build it again.",
  ],
  VP4011: ["{path}: the package contradicts itself: {problem}", "Build the package again."],
  VP4014: ["{path}: the package has no file {file}", "volprep inspect lists the files that it has."],
  VP4030: ["{name}: not a KTX 2 texture of the kind that packages hold: {problem}", "Build the package again."],
  VP5005: [
    "{path}: the driver {driver} does not compile this shader:{log}",
    "Rebuild the package; if the shaders are unchanged, report the log and the driver.",
  ],
  VP5006: [
    "program {name} ({paths}): the driver {driver} does not link it:{log}",
    "Rebuild the package; if the shaders are unchanged, report the log and the driver.",
  ],
  VP5007: [
    "OpenGL ES failed with {error} in {operation} on the driver {driver}",
    "If this is GL_OUT_OF_MEMORY, draw a smaller picture or a coarser level; otherwise report it.",
  ],
  VP5009: [
    "the driver {driver} cannot draw a picture of {width}×{height} pixels: each side must have 1 to {limit}",
    "Ask for another size.",
  ],
  VP5017: ["program {name}: the manifest names {named}, but the shaders use {found}", "Build the package again."],
  VP5018: [
    "{package}: the package cannot draw {level} with {transfer}. It can draw {known}",
    "Name one of these. Of a draft, run the stage shaders first.",
  ],
  VP5019: ["a step of {step_mm} mm is not possible here: {reason}", "Ask for another step."],
  VP7010: [
    "the package needs {needed}, but this page has {found}",
    "Use another browser or device, or build the package for the profile gles2-2048.",
  ],
  VP7011: [
    "texture {name}: {axis} {size} is more than this device takes, {limit}",
    "Draw a coarser level, or build the package for a profile with smaller textures.",
  ],
  VP7012: [
    "program {name} reads {count} textures, but this device reads {limit} in one program",
    "Build the package for a profile with fewer texture units.",
  ],
  VP7013: [
    "the textures of level {level} take {size} bytes, but {limit} are allowed here",
    "Draw a coarser level, or raise maxTextureBytes.",
  ],
  VP7014: [
    "this device draws textures of {format} wrongly: a few texels that must give {expected} give {found}",
    "Draw a level of another format, or build the package for a profile without this format.",
  ],
  VP7015: ["{url}: the server answers {answer}", "Check the address and the server."],
  VP7016: ["{url}: nothing has arrived for {seconds} s", "Check the connection and try again."],
  VP7018: ["this renderer cannot draw: {problem}", "Make a new renderer, or wait until the context is there again."],
};

const LONGEST = 400;

/** Foreign text made safe for a message: without control characters, and shortened. @param {unknown} value */
function shown(value) {
  const text = String(value).replace(/[\u0000-\u0009\u000b-\u001f\u007f-\u009f\u2028-\u202e\u2066-\u2069]/g, "\uFFFD");
  return text.length > LONGEST ? `${text.slice(0, LONGEST)}...` : text;
}

/** An error with a permanent code. Its message is code, summary and remedy. */
export class VolpkgError extends Error {
  /** @param {string} code @param {Record<string, unknown>} fields values of the names in braces */
  constructor(code, fields = {}) {
    const [summary, remedy] = WORDS[code].map((words) => words.replace(/\{(\w+)\}/g, (_, key) => shown(fields[key])));
    super(`${code} ${summary}. ${remedy}`);
    this.name = "VolpkgError";
    /** Values in the message. */
    this.fields = fields;
    /** Permanent code, for example "VP4009". */
    this.code = code;
    /** The problem, without code and remedy. */
    this.summary = summary;
    /** The remedy. */
    this.remedy = remedy;
    /** File of the package, or the package itself, that the error is about. @type {string | undefined} */
    this.file = [fields.file, fields.path, fields.name].filter(Boolean).map(shown)[0];
  }
}
