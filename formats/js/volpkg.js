/** Opens volume packages of volprep and draws them with WebGL 1 and 2. formats/spec specifies the format. */
export { VolpkgError } from "./core/error.js";
export { Package, openPackage } from "./core/package.js";
export { Renderer, createRenderer } from "./core/renderer.js";
