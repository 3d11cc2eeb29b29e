/** Names of the segments under the mouse, once it rests. */
import { make } from "./dom.js";
import { showProblem } from "./problems.js";

/** Longer than a stage waits until it draws at full quality: a name belongs to that picture. */
const REST_MS = 250;
const AWAY_PX = 14;

/**
 * Shows the names beside the pointer, inside the element that frames the picture.
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {HTMLElement} frame
 * @param {Map<string, string>} titles of segments, by name
 */
export function hoverNames(stage, frame, titles) {
  const { canvas } = stage.gl;
  // The ruler reads out the same names for keys and touch.
  const note = make("p", { className: "hovered", hidden: true, "aria-hidden": "true" });
  frame.append(note);
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let rest;
  let moves = 0;
  const leave = () => {
    clearTimeout(rest);
    moves++;
    note.hidden = true;
  };
  /** @param {PointerEvent} at */
  const show = async ({ clientX, clientY }) => {
    const now = moves;
    const text = await named(stage, canvas, titles, clientX, clientY);
    // The mouse may have moved on while the names were found.
    if (now !== moves || !text) return;
    const { left, top, width } = frame.getBoundingClientRect();
    note.textContent = text;
    note.hidden = false;
    const right = width - note.offsetWidth - AWAY_PX;
    note.style.left = `${Math.max(0, Math.min(clientX - left + AWAY_PX, right))}px`;
    note.style.top = `${clientY - top + AWAY_PX}px`;
  };
  canvas.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
    leave();
    if (event.pointerType === "mouse" && !event.buttons)
      rest = setTimeout(() => show(event).catch(showProblem), REST_MS);
  });
  for (const type of ["pointerleave", "pointerdown", "wheel", "keydown"])
    canvas.addEventListener(type, leave, { passive: true });
}

/**
 * Titles of the segments seen at a place of the page; "" if no segment is there.
 * @param {import("../runtime/stage.js").Stage} stage @param {HTMLCanvasElement} canvas @param {Map<string, string>} titles
 * @param {number} clientX @param {number} clientY
 */
async function named({ busy, renderer }, canvas, titles, clientX, clientY) {
  // Nothing else may be drawn while the device is measured.
  if (busy || !renderer.inside?.last) return "";
  const { left, top, width, height } = canvas.getBoundingClientRect();
  const hit = await renderer.pick(
    ((clientX - left) / width) * canvas.width,
    ((clientY - top) / height) * canvas.height,
  );
  return (hit?.segments ?? []).map((name) => titles.get(name) ?? name).join(" and ");
}
