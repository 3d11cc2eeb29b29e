/** Opens volume packages of volprep and draws them with WebGL 1 and 2. formats/spec specifies the format. */
export { VolpkgError } from "./error.js";
export { Package, openPackage } from "./package.js";
export { Renderer, createRenderer } from "./renderer.js";
