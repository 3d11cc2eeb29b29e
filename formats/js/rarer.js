/** Messages of what is loaded only when a package or an app needs it. */
import { VolpkgError, WORDS } from "./error.js";

Object.assign(WORDS, {
  VP4032: ["{path}: not a joint histogram: {problem}", "Build the package again."],
  VP4039: ["{name}: not a mesh of the kind that packages hold: {problem}", "Build the package again."],
  VP5023: [
    "{path}: the transfer functions of this package are not editable",
    "Build it from a scene with editable = true.",
  ],
  VP7019: ["the picture cannot be clipped by {what}", "Give a box in millimetres, and at most {limit} planes, each four numbers."],
  VP7020: ["these are no points of a transfer function: {problem}", "Give points in ascending order of value, with colour and extinction_per_mm."],
  VP7021: [
    "program {name} draws {technique}, which is not possible here: {problem}",
    "Use a browser and a device that have it, or build the package with another technique.",
  ],
  VP7064: [
    "{file}: the mesh is compressed with Draco, and the app gives no decoder; rays begin at the box, and the picture is the same",
    'For the speed of a mesh give createRenderer a decodeDraco, or build the package with draco = "none" in [proxy].',
  ],
  VP7063: ["the light cannot be moved: {problem}", "Give x, y and z in millimetres, for a package that was built with lighting phong or blinn-phong."],
});

export { VolpkgError };
