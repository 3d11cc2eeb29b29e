/**
 * Axial, coronal and sagittal slices beside the volume, with one crosshair: a click in a picture moves the others.
 * Grey over a window of values, which a drag changes; the wheel goes through the slices.
 */
import { PLANES, PLANE_NAMES, grey } from "../runtime/slices.js";
import { byId, make } from "./dom.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";

const STEPS = 200;
/** A pointer that has moved further than this changes the window, or has turned the volume. */
const CLICK_PX = 4;
/** The direction in which the position grows. @type {Record<string, string>} */
const ACROSS = { axial: "feet to head", coronal: "front to back", sagittal: "right to left" };
/** Letters at the left, right, upper and lower edge. @type {Record<string, string>} */
const LETTERS = { axial: "RLAP", coronal: "RLHF", sagittal: "APHF" };
/** Windows that radiologists use for Hounsfield units, as level and width. @type {Record<string, number[]>} */
const CT_WINDOWS = { "soft tissue": [40, 400], lung: [-600, 1500], bone: [400, 1800], brain: [40, 80] };

/**
 * Fills the card, and puts the slices beside the volume while it is open, at the level that the picture has.
 * @param {any} viewer the element
 * @param {any} manifest
 */
export function sliceControls(viewer, manifest) {
  const { stage } = viewer;
  const { renderer } = stage;
  const window = windowControls(manifest, () => views.forEach((each) => each.paint()));
  /** Where the crosshair is, in the patient's space. @type {number[] | null} */
  let cross = null;
  const go = (/** @type {number[]} */ place) => {
    cross = place;
    show();
  };
  const views = PLANE_NAMES.map((plane) => sliceView(plane, renderer, window, () => cross, go));
  const note = make("p", { className: "hint", role: "status" });
  byId("slices-body").replaceChildren(...views.map((each) => each.field), ...window.fields, note);
  let busy = false;
  let again = false;
  const show = async () => {
    again = true;
    if (busy || !byId("slices").open) return;
    busy = true;
    while (again) {
      again = false;
      try {
        for (const each of views) await each.read();
      } catch (error) {
        showProblem(error);
      }
      const isThere = views.every((each) => each.isThere());
      note.textContent = isThere ? "" : "The shaders of this picture read no values of the scan: there are no slices.";
      frame.classList.toggle("four", isThere);
      for (const each of views) each.paint();
    }
    busy = false;
  };
  const frame = byId("frame");
  byId("slices").addEventListener("toggle", () => {
    const { open } = byId("slices");
    if (open) for (const each of views) frame.append(each.box);
    else {
      for (const each of views) each.box.remove();
      frame.classList.remove("four");
    }
    show();
  });
  onClick(viewer, async ({ clientX, clientY }) => {
    if (!byId("slices").open) return;
    const canvas = stage.gl.canvas;
    const { left, top, width, height } = canvas.getBoundingClientRect();
    stage.still();
    stage.draw();
    const at = [((clientX - left) / width) * canvas.width, ((clientY - top) / height) * canvas.height];
    const hit = await renderer.pick(at[0], at[1]).catch(showProblem);
    if (hit) go(hit.position_mm);
  });
  return { show };
}

/**
 * One plane: its picture, and a slider for its place.
 * @param {import("../runtime/slices.js").Plane} plane @param {import("../runtime/renderer.js").Renderer} renderer
 * @param {ReturnType<typeof windowControls>} window @param {() => number[] | null} cross
 * @param {(place: number[]) => void} go moves the crosshair
 */
function sliceView(plane, renderer, window, cross, go) {
  const [[x, signX], [y, signY], across] = PLANES[plane];
  const canvas = make("canvas", { role: "img", width: 1, height: 1 });
  const lines = ["across", "down"].map((each) => make("i", { className: each, "aria-hidden": "true" }));
  const letters = ["left", "right", "above", "below"].map((each, i) =>
    make("span", { className: each, "aria-hidden": "true" }, LETTERS[plane][i]),
  );
  const box = make("div", { className: "slice" }, canvas, ...lines, ...letters);
  const at = slider(`slice-${plane}`, 0, STEPS, STEPS / 2, 1);
  /** @type {import("../runtime/slices.js").Slice | null} */
  let slice = null;

  const read = async () => {
    const place = cross();
    if (place && slice) {
      const [low, high] = slice.range_mm;
      const share = Math.min(1, Math.max(0, (place[across] - low) / (high - low)));
      at.input.value = String(share * STEPS);
    }
    slice = await renderer.slice({ plane, at: Number(at.input.value) / STEPS });
  };
  const middle = () => {
    const { corner_mm: corner, pixel_mm: mm, width, height, position_mm } = /** @type {any} */ (slice);
    const place = [...corner];
    place[x] += (signX * mm * width) / 2;
    place[y] += (signY * mm * height) / 2;
    place[across] = position_mm;
    return place;
  };
  const paint = () => {
    if (!slice) return;
    const { width, height, corner_mm: corner, pixel_mm: mm, position_mm } = slice;
    Object.assign(canvas, { width, height });
    canvas.getContext("2d").putImageData(new ImageData(grey(slice, window.now()), width, height), 0, 0);
    const told = `${number(position_mm)} mm`;
    at.output.value = told;
    at.input.setAttribute("aria-valuetext", told);
    canvas.setAttribute("aria-label", `The ${plane} slice at ${told}, ${ACROSS[plane]}.`);
    const place = cross() ?? middle();
    const { left, top, scale } = fitted(canvas, width, height);
    lines[0].style.top = `${top + ((signY * (place[y] - corner[y])) / mm) * scale}px`;
    lines[1].style.left = `${left + ((signX * (place[x] - corner[x])) / mm) * scale}px`;
  };
  const moveBy = (/** @type {number} */ steps) => {
    if (!slice) return;
    const place = cross() ?? middle();
    const [low, high] = slice.range_mm;
    place[across] = Math.min(high, Math.max(low, slice.position_mm + (steps * (high - low)) / STEPS));
    go([...place]);
  };
  at.input.addEventListener("input", () => {
    if (!slice) return;
    const place = cross() ?? middle();
    const [low, high] = slice.range_mm;
    place[across] = low + (Number(at.input.value) / STEPS) * (high - low);
    go([...place]);
  });
  box.addEventListener(
    "wheel",
    (/** @type {WheelEvent} */ event) => {
      event.preventDefault();
      moveBy(Math.sign(event.deltaY));
    },
    { passive: false },
  );
  onClick(box, ({ clientX, clientY }) => {
    if (!slice) return;
    const around = canvas.getBoundingClientRect();
    const { left, top, scale } = fitted(canvas, slice.width, slice.height);
    const place = middle();
    place[x] = slice.corner_mm[x] + (signX * slice.pixel_mm * (clientX - around.left - left)) / scale;
    place[y] = slice.corner_mm[y] + (signY * slice.pixel_mm * (clientY - around.top - top)) / scale;
    go(place);
  });
  onDrag(box, window.drag);
  new ResizeObserver(paint).observe(canvas);
  return { box, read, paint, isThere: () => slice !== null, field: field(`${plane} slice`, at.input, at.output) };
}

/** Where `object-fit: contain` puts a picture. @param {HTMLElement} canvas @param {number} width @param {number} height */
function fitted({ clientWidth, clientHeight }, width, height) {
  const scale = Math.min(clientWidth / width, clientHeight / height);
  return { scale, left: (clientWidth - scale * width) / 2, top: (clientHeight - scale * height) / 2 };
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
    ...[...Object.keys(windows), "own"].map((each) => make("option", { value: each }, each)),
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

/** Calls for a press that does not move. @param {HTMLElement} element @param {(event: PointerEvent) => void} act */
function onClick(element, act) {
  let down = { clientX: 0, clientY: 0 };
  element.addEventListener("pointerdown", (event) => (down = event));
  element.addEventListener("pointerup", (event) => {
    if (Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) <= CLICK_PX) act(event);
  });
}

/** Calls with the pixels that a pressed pointer moves. @param {HTMLElement} element @param {(x: number, y: number) => void} act */
function onDrag(element, act) {
  let far = 0;
  element.addEventListener("pointerdown", (event) => {
    far = 0;
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    far += Math.hypot(event.movementX, event.movementY);
    if (far > CLICK_PX) act(event.movementX, event.movementY);
  });
}

/** @param {string} id @param {number} min @param {number} max @param {number} value @param {number} step */
function slider(id, min, max, value, step) {
  return { input: make("input", { type: "range", id, min, max, step, value }), output: make("output", { for: id }) };
}

/** @param {string} text @param {any} input @param {any} [output] */
const field = (text, input, output = "") =>
  make("div", { className: "field" }, make("label", { for: input.id }, text), output, input);
