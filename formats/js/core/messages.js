/** Messages of modules that are loaded on demand. */
import { VolpkgError, WORDS } from "./error.js";

Object.assign(WORDS, {
  VP4003: [
    "{path}: the package has version {version} of the format, but this volprep reads {known}",
    "Use the volprep that wrote the package, or build the package again.",
  ],
  VP4004: ["{path}: the manifest breaks the schema: {problems}", "Build the package again."],
  VP4005: [
    "{path}: the package is a draft, still under construction",
    "Run volprep stage seal on it. That finishes the package, or names the stage that is missing.",
  ],
  VP4032: ["{path}: not a joint histogram: {problem}", "Build the package again."],
  VP4039: ["{name}: not a mesh of the kind that packages hold: {problem}", "Build the package again."],
  VP4061: [
    "{path}: {file} is damaged: its CRC-32 is not the one in the zip",
    "Copy the package again, or make it again with volprep zip.",
  ],
  VP4070: [
    "{path}: the package requires extensions that this reader does not know: {extensions}",
    "Use a reader that knows them, or ask the author for a package without them.",
  ],
  VP5023: [
    "{path}: the transfer functions of this package are not editable",
    "Build it from a scene with editable = true.",
  ],
  VP5043: [
    "{path}: the brick x {x}, y {y}, z {z} of level {level}, from byte {begin} of {file} on, is damaged: {error}",
    "It is drawn from the next coarser level. Get the package again from where it came, or build it again.",
  ],
  VP7017: [
    "a package cannot be opened from {what}",
    "Give openPackage the address of a folder or .volpkg.zip, a File, a Blob or an ArrayBuffer; await it.",
  ],
  VP7019: [
    "the picture cannot be clipped by {what}",
    "Give box as [[x, y, z], [x, y, z]] in millimetres, and planes of four numbers: at most {limit}, a box being six.",
  ],
  VP7020: [
    "these points are not a transfer function: {problem}",
    "Give points in ascending order of value, with colour and extinction_per_mm.",
  ],
  VP7021: [
    "program {name} draws {technique}, which is not possible here: {problem}",
    "Use a browser and a device that have it, or build the package with another technique.",
  ],
  VP7041: [
    "this browser cannot draw with WebGL: {reason}",
    "Use a browser with WebGL, and allow it graphics acceleration.",
  ],
  VP7063: [
    "the light cannot be changed: {problem}",
    "Give x, y and z in millimetres for lighting phong or blinn-phong, or the light around for turnable = true.",
  ],
  VP7064: [
    "{file}: the mesh is compressed with Draco, and the app gives no decoder; rays begin at the box, and the picture is the same",
    'For the speed of a mesh give createRenderer a decodeDraco, or build the package with draco = "none" in [proxy].',
  ],
  VP7080: [
    "nothing can be picked at {what}: {reason}",
    "Draw first, and give a pixel of the picture and an opacity between 0 and 1.",
  ],
  VP7081: [
    "the attribute {name} cannot be {value}: {reason}",
    "Give another value; README.md of volpkg lists what the attributes of volume-viewer take.",
  ],
  VP7082: ["there is no slice {what}: {reason}", "Give a plane, a position from 0 to 1, and a size in pixels."],
  VP7083: [
    "the segment {name} cannot be changed: {problem}",
    "Take names from renderer.segments; a look has visible, tint (three numbers) and opacity, from 0 to 1.",
  ],
  VP7084: [
    "the medium {transfer} cannot have the opacity {opacity}",
    "Name a transfer function of a picture whose channels lie on several grids, and give a number from 0 on.",
  ],
  VP7085: ["these points cannot be read: {problem}", "Give a file that Save points has written."],
});

export { VolpkgError };
