/** Turns, moves and zooms a camera by pointer, fingers, wheel and keys. */

const RADIANS_ACROSS = Math.PI;
const KEY_RADIANS = Math.PI / 36;
const KEY_SHARE = 0.04;
const KEY_ZOOM = 1.15;
const [LEAST_ZOOM, MOST_ZOOM] = [0.2, 40];

/**
 * @typedef {{turn: (right: number, down: number) => void, pan: (right: number, up: number) => void, zoom: number}}
 *   Turned
 */

/** Callbacks after a gesture or a key. @typedef {{moved: () => void, reset: () => void, save: () => void}} Then */

/**
 * Lets people move a camera.
 * @param {HTMLElement} element
 * @param {Turned} orbit
 * @param {Then} then
 * @param {AbortSignal} [signal] ends it
 */
export function listen(element, orbit, then, signal) {
  /** Fingers and buttons that are down. @type {Map<number, {x: number, y: number}>} */
  const down = new Map();
  element.addEventListener(
    "pointerdown",
    (event) => {
      if (event.pointerType === "mouse" && event.button > 2) return;
      element.focus({ preventScroll: true });
      element.setPointerCapture(event.pointerId);
      down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    },
    { signal },
  );
  element.addEventListener(
    "pointermove",
    (event) => {
      const before = down.get(event.pointerId);
      if (!before) return;
      const now = { x: event.clientX, y: event.clientY };
      const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
      const { clientWidth: width, clientHeight: height } = element;
      const [right, below] = [now.x - before.x, now.y - before.y];
      if (other) {
        // Each finger moves the picture by its half, and changes the distance between them.
        orbit.pan(right / 2 / height, -below / 2 / height);
        zoomBy(orbit, distance(now, other) / distance(before, other));
      } else if (event.shiftKey || event.buttons & 6) orbit.pan(right / height, -below / height);
      else {
        const radians = RADIANS_ACROSS / Math.min(width, height);
        orbit.turn(right * radians, below * radians);
      }
      down.set(event.pointerId, now);
      then.moved();
    },
    { signal },
  );
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
    element.addEventListener(end, (event) => down.delete(/** @type {PointerEvent} */ (event).pointerId), { signal });
  }
  element.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode ? event.deltaY * 16 : event.deltaY;
      zoomBy(orbit, Math.exp(-Math.max(-200, Math.min(200, lines)) / 500));
      then.moved();
    },
    { passive: false, signal },
  );
  element.addEventListener(
    "keydown",
    (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (!press(event, orbit, then)) return;
      event.preventDefault();
    },
    { signal },
  );
}

/** @type {Record<string, [right: number, down: number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** @param {KeyboardEvent} event @param {Turned} orbit @param {Then} then */
function press({ key, shiftKey }, orbit, then) {
  const arrow = ARROWS[key];
  if (arrow && shiftKey) orbit.pan(arrow[0] * KEY_SHARE, -arrow[1] * KEY_SHARE);
  else if (arrow) orbit.turn(arrow[0] * KEY_RADIANS, arrow[1] * KEY_RADIANS);
  else if (key === "+" || key === "=") zoomBy(orbit, KEY_ZOOM);
  else if (key === "-" || key === "_") zoomBy(orbit, 1 / KEY_ZOOM);
  else if (key === "0" || key === "Home") then.reset();
  else if (key === "s" || key === "S") then.save();
  else return false;
  if (key !== "s" && key !== "S") then.moved();
  return true;
}

/** @param {Turned} orbit @param {number} factor */
function zoomBy(orbit, factor) {
  if (!(factor > 0 && Number.isFinite(factor))) return;
  orbit.zoom = Math.min(MOST_ZOOM, Math.max(LEAST_ZOOM, orbit.zoom * factor));
}

/** @param {{x: number, y: number}} a @param {{x: number, y: number}} b */
const distance = (a, b) => Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
