/** The page of a package for OpenGL ES 1.1: the picture of its slices, and the editor of its transfer functions. */
import { createRenderer } from "../runtime/volpkg.js";
import { byId, make } from "./dom.js";
import { functionEditor } from "./editor.js";
import { backgroundControl } from "./look.js";
import { SliceRenderer } from "./slice_renderer.js";

/**
 * The renderer of a package: slices of OpenGL ES 1.1 have their own.
 * @param {any} gl @param {import("../runtime/volpkg.js").Package} pack
 * @param {import("../runtime/options.js").RendererOptions} options
 * @returns {Promise<any>}
 */
export async function rendererOf(gl, pack, options) {
  if (pack.manifest.on_demand) return (await import("../runtime/on_demand.js")).createOnDemand(gl, pack, options);
  if (pack.manifest.profile.api !== "es1.1") return createRenderer(gl, pack, options);
  const renderer = new SliceRenderer(gl, pack);
  await renderer.setProgram(pack.transferFunctions[0].name);
  return renderer;
}

/**
 * Adds the controls of slices.
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {import("../runtime/volpkg.js").Package} pack
 */
export function showSlices(stage, pack) {
  const { manifest } = pack;
  for (const id of ["level", "step", "error", "measure", "cut", "ruler", "slices"]) hide(byId(id));
  const editor = functionEditor(stage, manifest, byId("function"), {}, () => stage.redraw());
  const choice = byId("transfer");
  choice.append(...pack.transferFunctions.map(({ name }) => make("option", { value: name }, name)));
  choice.disabled = pack.transferFunctions.length < 2;
  choice.addEventListener("change", async () => {
    await stage.renderer.setProgram(choice.value);
    editor.show();
    stage.redraw();
  });
  backgroundControl();
}

/** Hides what slices do not have: the field or the card of an element. @param {HTMLElement} element */
function hide(element) {
  const whole = element.closest(".field") ?? element.closest(".card") ?? element;
  /** @type {HTMLElement} */ (whole).hidden = true;
}
