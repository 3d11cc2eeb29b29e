/**
 * Axial, coronal and sagittal slices beside the volume, with one crosshair: a click in a picture moves the others.
 * Grey over a window of values, which a drag changes, with the outlines of segments; the wheel goes through the slices,
 * and zooms with Ctrl.
 */
import { byId, field, make, slider } from "./dom.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";
import { MOST_ZOOM, linkedSlices, onClick } from "./slice_view.js";

/** Steps of a window over all values. */
const STEPS = 200;
/** Windows that radiologists use for Hounsfield units, as level and width. @type {Record<string, number[]>} */
const CT_WINDOWS = { "soft tissue": [40, 400], lung: [-600, 1500], bone: [400, 1800], brain: [40, 80] };

/**
 * Fills the card, and puts the slices beside the volume while it is open, at the level that the picture has.
 * @param {any} viewer the element
 * @param {any} manifest
 * @param {(plane: import("../runtime/slices.js").Plane, share: number) => void} moved called with the place of each slice
 */
export function sliceControls(viewer, manifest, moved) {
  const [card, frame] = [byId("slices"), byId("frame")];
  const window = windowControls(manifest, () => views.forEach((view) => view.paint()));
  const note = make("p", { className: "hint", role: "status" });
  const shown = (/** @type {boolean} */ isThere) => {
    note.textContent = isThere ? "" : "The shaders of this picture read no values of the scan: there are no slices.";
    const isNew = !frame.classList.contains("four");
    if (frame.classList.toggle("four", isThere && card.open) && isNew)
      frame.scrollIntoView({ block: frame.clientHeight > innerHeight ? "start" : "nearest" });
    if (isThere) for (const view of views) moved(view.plane, view.share());
  };
  const zoom = slider("slice-zoom", 1, MOST_ZOOM, 1, 0.1);
  const zoomed = (/** @type {number} */ value) => {
    zoom.input.value = String(value);
    zoom.output.value = `${number(value, 2)}×`;
  };
  const told = { shown, zoomed, failed: showProblem };
  const { views, go, read, zoomAll } = linkedSlices(viewer.stage.renderer, window, told);
  zoomed(1);
  zoom.input.addEventListener("input", () => zoomAll(Number(zoom.input.value)));
  const zoomField = field("Zoom", zoom.input, zoom.output);
  byId("slices-body").replaceChildren(...views.map((view) => view.field), zoomField, ...window.fields, note);
  const show = () => card.open && read();
  card.addEventListener("toggle", () => {
    if (card.open) frame.append(...views.map((view) => view.box));
    else {
      for (const view of views) view.box.remove();
      frame.classList.remove("four");
    }
    show();
  });
  onClick(viewer, async (event) => {
    const hit = card.open && (await placeOf(event, viewer.stage).catch(showProblem));
    if (hit) go(hit.position_mm);
  });
  return {
    show,
    /** Puts a slice at a share of its way. @param {string} plane @param {number} share */
    put: (plane, share) => {
      views.find((view) => view.plane === plane)?.put(share);
      show();
    },
  };
}

/** What the volume shows under a pointer. @param {PointerEvent} event @param {any} stage */
function placeOf({ clientX, clientY }, stage) {
  const { canvas } = stage.gl;
  const { left, top, width, height } = canvas.getBoundingClientRect();
  stage.still();
  stage.draw();
  return stage.renderer.pick(((clientX - left) / width) * canvas.width, ((clientY - top) / height) * canvas.height);
}

/** Controls of the window of values. @param {any} manifest @param {() => void} changed */
function windowControls(manifest, changed) {
  const channel = manifest.channels[0];
  const [low, high] = channel.quantization.window;
  const isCt = channel.source.info.modality === "CT";
  /** @type {Record<string, number[]>} */
  const windows = { "all values": [(low + high) / 2, high - low], ...(isCt ? CT_WINDOWS : {}) };
  const preset = make(
    "select",
    { id: "slice-window" },
    ...[...Object.keys(windows), "own"].map((value) => make("option", { value: value }, value)),
  );
  const step = (high - low) / STEPS;
  const [begin, most] = windows["all values"];
  const level = slider("slice-level", low, high, begin, step);
  const width = slider("slice-width", step, 2 * (high - low), most, step);
  const tell = () => {
    for (const each of [level, width]) each.output.value = number(Number(each.input.value));
    changed();
  };
  const own = () => {
    preset.value = "own";
    tell();
  };
  for (const each of [level, width]) each.input.addEventListener("input", own);
  preset.addEventListener("change", () => {
    const found = windows[preset.value];
    if (found) [level.input.value, width.input.value] = found.map(String);
    tell();
  });
  const drag = (/** @type {number} */ across, /** @type {number} */ down) => {
    width.input.value = String(Number(width.input.value) + across * step);
    level.input.value = String(Number(level.input.value) + down * step);
    own();
  };
  const now = () => ({ level: Number(level.input.value), width: Number(width.input.value) });
  for (const each of [level, width]) each.output.value = number(Number(each.input.value));
  const fields = [
    field("Window", preset),
    field("Level", level.input, level.output),
    field("Width", width.input, width.output),
  ];
  return { now, drag, fields };
}
