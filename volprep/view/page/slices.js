/** Slices across the patient's axes, in grey over a window of values. */
import { PLANE_NAMES, grey } from "../runtime/slices.js";
import { byId, make } from "./dom.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";

const STEPS = 200;
/** The direction in which the position grows. @type {Record<string, string>} */
const ACROSS = { axial: "feet to head", coronal: "front to back", sagittal: "right to left" };
/** Letters at the left, right, upper and lower edge. @type {Record<string, string>} */
const LETTERS = { axial: "RLAP", coronal: "RLHF", sagittal: "APHF" };
/** Windows that radiologists use for Hounsfield units, as level and width. @type {Record<string, number[]>} */
const CT_WINDOWS = { "soft tissue": [40, 400], lung: [-600, 1500], bone: [400, 1800], brain: [40, 80] };

/**
 * Fills the card. A slice is drawn while the card is open, at the level that the picture has.
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {any} manifest
 */
export function sliceControls({ renderer }, manifest) {
  const channel = manifest.channels[0];
  const [low, high] = channel.quantization.window;
  const isCt = channel.source.info.modality === "CT";
  /** @type {Record<string, number[]>} */
  const windows = { "all values": [(low + high) / 2, high - low], ...(isCt ? CT_WINDOWS : {}) };
  const plane = make(
    "select",
    { id: "slice-plane" },
    ...PLANE_NAMES.map((each) => make("option", { value: each }, each)),
  );
  const preset = make(
    "select",
    { id: "slice-window" },
    ...[...Object.keys(windows), "own"].map((each) => make("option", { value: each }, each)),
  );
  const at = slider("slice-at", 0, STEPS, STEPS / 2, 1);
  const level = slider("slice-level", low, high, windows["all values"][0], (high - low) / STEPS);
  const width = slider(
    "slice-width",
    (high - low) / STEPS,
    2 * (high - low),
    windows["all values"][1],
    (high - low) / STEPS,
  );
  const canvas = make("canvas", { role: "img", width: 1, height: 1 });
  const letters = ["left", "right", "above", "below"].map((each) =>
    make("span", { className: each, "aria-hidden": "true" }),
  );
  const note = make("p", { className: "hint", role: "status" });
  const body = byId("slices-body");
  body.replaceChildren(
    make("div", { className: "slice" }, canvas, ...letters),
    field("Plane", plane),
    field("Position", at.input, at.output),
    field("Window", preset),
    field("Level", level.input, level.output),
    field("Width", width.input, width.output),
    note,
  );
  /** @type {import("../runtime/slices.js").Slice | null} */
  let slice = null;
  const paint = () => {
    level.output.value = number(Number(level.input.value));
    width.output.value = number(Number(width.input.value));
    if (!slice) return;
    const window = { level: Number(level.input.value), width: Number(width.input.value) };
    Object.assign(canvas, { width: slice.width, height: slice.height });
    canvas.getContext("2d").putImageData(new ImageData(grey(slice, window), slice.width, slice.height), 0, 0);
    const place = `${number(slice.position_mm)} mm`;
    at.output.value = place;
    at.input.setAttribute("aria-valuetext", place);
    letters.forEach((each, i) => (each.textContent = LETTERS[plane.value][i]));
    canvas.setAttribute("aria-label", `The ${plane.value} slice at ${place}, ${ACROSS[plane.value]}.`);
  };
  let busy = false;
  let again = false;
  const show = async () => {
    again = true;
    if (busy || !byId("slices").open) return;
    busy = true;
    while (again) {
      again = false;
      try {
        slice = await renderer.slice({ plane: plane.value, at: Number(at.input.value) / STEPS });
      } catch (error) {
        showProblem(error);
      }
      note.textContent = slice ? "" : "The shaders of this picture read no values of the scan: there are no slices.";
      paint();
    }
    busy = false;
  };
  const own = () => {
    preset.value = "own";
    paint();
  };
  for (const each of [level, width]) each.input.addEventListener("input", own);
  for (const [each, type] of [
    [plane, "change"],
    [at.input, "input"],
  ])
    each.addEventListener(type, show);
  preset.addEventListener("change", () => {
    const found = windows[preset.value];
    if (found) [level.input.value, width.input.value] = found.map(String);
    paint();
  });
  byId("slices").addEventListener("toggle", show);
  return { show };
}

/** @param {string} id @param {number} min @param {number} max @param {number} value @param {number} step */
function slider(id, min, max, value, step) {
  return { input: make("input", { type: "range", id, min, max, step, value }), output: make("output", { for: id }) };
}

/** @param {string} text @param {any} input @param {any} [output] */
const field = (text, input, output = "") =>
  make("div", { className: "field" }, make("label", { for: input.id }, text), output, input);
