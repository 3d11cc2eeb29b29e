/**
 * Axial, coronal and sagittal slices beside the volume, with one crosshair: a click in a picture moves the others.
 * Grey over a window of values, which a drag changes, with the outlines of segments; the wheel goes through the slices,
 * and zooms with Ctrl.
 */
import { PLANES, PLANE_NAMES, grey, outline } from "../runtime/slices.js";
import { byId, make } from "./dom.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";

const STEPS = 200;
const MOST_ZOOM = 8;
/** Pixels along the longer side of a slice, and of one that is zoomed. */
const [SIZE, ZOOMED_SIZE] = [256, 512];
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
 * @param {(plane: import("../runtime/slices.js").Plane, share: number) => void} moved called with the place of each slice
 */
export function sliceControls(viewer, manifest, moved) {
  const { stage } = viewer;
  const { renderer } = stage;
  const window = windowControls(manifest, () => views.forEach((view) => view.paint()));
  /** Where the crosshair is, in the patient's space. @type {number[] | null} */
  let cross = null;
  const go = (/** @type {number[]} */ place) => {
    cross = place;
    show();
  };
  const zoom = slider("slice-zoom", 1, MOST_ZOOM, 1, 0.1);
  /** Zooms all slices; the one of `plane` around a place of its box, the others around the crosshair. */
  const zoomAll = (/** @type {number} */ wanted, plane = "", /** @type {number[]} */ at = []) => {
    const next = Math.min(MOST_ZOOM, Math.max(1, wanted));
    zoom.input.value = String(next);
    zoom.output.value = `${number(next, 2)}×`;
    for (const view of views) view.zoomTo(next, view.plane === plane ? at : null);
    show();
  };
  zoom.input.addEventListener("input", () => zoomAll(Number(zoom.input.value)));
  const views = PLANE_NAMES.map((plane) => sliceView(plane, renderer, window, () => cross, go, zoomAll));
  const note = make("p", { className: "hint", role: "status" });
  const zoomField = field("Zoom", zoom.input, zoom.output);
  byId("slices-body").replaceChildren(...views.map((view) => view.field), zoomField, ...window.fields, note);
  let busy = false;
  let again = false;
  const show = async () => {
    again = true;
    if (busy || !byId("slices").open) return;
    busy = true;
    while (again) {
      again = false;
      try {
        for (const view of views) await view.read();
      } catch (error) {
        showProblem(error);
      }
      const isThere = views.every((view) => view.isThere());
      note.textContent = isThere ? "" : "The shaders of this picture read no values of the scan: there are no slices.";
      frame.classList.toggle("four", isThere);
      for (const view of views) view.paint();
      if (isThere) for (const view of views) moved(view.plane, view.share());
    }
    busy = false;
  };
  const frame = byId("frame");
  byId("slices").addEventListener("toggle", () => {
    const { open } = byId("slices");
    if (open) for (const view of views) frame.append(view.box);
    else {
      for (const view of views) view.box.remove();
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
  return {
    show,
    /** Puts a slice at a share of its way. @param {string} plane @param {number} share */
    put: (plane, share) => {
      views.find((view) => view.plane === plane)?.put(share);
      show();
    },
  };
}

/**
 * One plane: its picture, and a slider for its place.
 * @param {import("../runtime/slices.js").Plane} plane @param {import("../runtime/renderer.js").Renderer} renderer
 * @param {ReturnType<typeof windowControls>} window @param {() => number[] | null} cross
 * @param {(place: number[]) => void} go moves the crosshair
 * @param {(zoom: number, plane: string, at: number[]) => void} zoomAll
 */
function sliceView(plane, renderer, window, cross, go, zoomAll) {
  const [[x, signX], [y, signY], across] = PLANES[plane];
  const canvas = make("canvas", { role: "img", width: 1, height: 1 });
  const lines = ["across", "down"].map((value) => make("i", { className: value, "aria-hidden": "true" }));
  const letters = ["left", "right", "above", "below"].map((each, i) =>
    make("span", { className: each, "aria-hidden": "true" }, LETTERS[plane][i]),
  );
  const box = make("div", { className: "slice" }, canvas, ...lines, ...letters);
  const at = slider(`slice-${plane}`, 0, STEPS, STEPS / 2, 1);
  /** @type {import("../runtime/slices.js").Slice | null} */
  let slice = null;
  let zoom = 1;
  /** Where the left upper corner of the zoomed picture is in its box. */
  let offset = [0, 0];

  const share = () => Number(at.input.value) / STEPS;
  const read = async () => {
    const place = cross();
    if (place && slice) {
      const [low, high] = slice.range_mm;
      const part = Math.min(1, Math.max(0, (place[across] - low) / (high - low)));
      at.input.value = String(part * STEPS);
    }
    const size = zoom > 1 ? ZOOMED_SIZE : SIZE;
    slice = await renderer.slice({ plane, at: share(), size, labels: true });
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
    const { width, height, position_mm } = slice;
    Object.assign(canvas, { width, height });
    const pixels = outline(grey(slice, window.now()), slice, renderer);
    canvas.getContext("2d").putImageData(new ImageData(pixels, width, height), 0, 0);
    const told = `${number(position_mm)} mm`;
    at.output.value = told;
    at.input.setAttribute("aria-valuetext", told);
    canvas.setAttribute("aria-label", `The ${plane} slice at ${told}, ${ACROSS[plane]}.`);
    const crossed = crossing();
    lines[0].style.top = `${zoom * crossed[1] + offset[1]}px`;
    lines[1].style.left = `${zoom * crossed[0] + offset[0]}px`;
  };
  /** Where the crosshair is in the box, before the zoom. */
  const crossing = () => {
    const { width, height, corner_mm: corner, pixel_mm: mm } = /** @type {any} */ (slice);
    const place = cross() ?? middle();
    const { left, top, scale } = fitted(canvas, width, height);
    return [
      left + ((signX * (place[x] - corner[x])) / mm) * scale,
      top + ((signY * (place[y] - corner[y])) / mm) * scale,
    ];
  };
  /** Zooms around a place of the box, or around the crosshair. @param {number} next @param {number[] | null} around */
  const zoomTo = (next, around) => {
    if (!slice) return;
    const fixed = around ?? crossing().map((each, axis) => zoom * each + offset[axis]);
    const size = [canvas.clientWidth, canvas.clientHeight];
    offset = fixed.map((each, axis) =>
      Math.min(0, Math.max(size[axis] * (1 - next), each - ((each - offset[axis]) * next) / zoom)),
    );
    zoom = next;
    canvas.style.transform = `translate(${offset[0]}px, ${offset[1]}px) scale(${zoom})`;
    paint();
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
      const { left, top } = box.getBoundingClientRect();
      const pointer = [event.clientX - left, event.clientY - top];
      if (event.ctrlKey) zoomAll(zoom * 2 ** (-event.deltaY / 200), plane, pointer);
      else moveBy(Math.sign(event.deltaY));
    },
    { passive: false },
  );
  onClick(box, ({ clientX, clientY }) => {
    if (!slice) return;
    const around = box.getBoundingClientRect();
    const { left, top, scale } = fitted(canvas, slice.width, slice.height);
    const place = middle();
    const [right, below] = [clientX - around.left, clientY - around.top].map(
      (each, axis) => (each - offset[axis]) / zoom,
    );
    place[x] = slice.corner_mm[x] + (signX * slice.pixel_mm * (right - left)) / scale;
    place[y] = slice.corner_mm[y] + (signY * slice.pixel_mm * (below - top)) / scale;
    go(place);
  });
  onDrag(box, window.drag);
  new ResizeObserver(paint).observe(canvas);
  const put = (/** @type {number} */ wanted) => {
    const place = cross();
    if (!slice || !place) at.input.value = String(wanted * STEPS);
    else place[across] = slice.range_mm[0] + wanted * (slice.range_mm[1] - slice.range_mm[0]);
  };
  const isThere = () => slice !== null;
  return { plane, box, read, paint, zoomTo, share, put, isThere, field: field(`${plane} slice`, at.input, at.output) };
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
