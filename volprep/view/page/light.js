/** Controls of the light: where a light with a place is, or how the light around the volume is turned. */
import { middle } from "../runtime/camera.js";
import { byId } from "./dom.js";
import { showProblem } from "./problems.js";

const DEGREE = Math.PI / 180;
/** Share of the volume's diagonal that is outside of it in every direction. */
const OUTSIDE = 0.55;
/** Whose precomputed light is drawn, by the `light` of a fidelity record. */
const LINES = {
  whole: "Light: stored by the package, for the whole volume.",
  cut: "Light: stored by the package, for this cut.",
  edited: "Light: left out; the stored light is of another transfer function.",
  occlusion: "Light: ambient occlusion of your transfer function, computed on this device.",
};

/** @typedef {import("../runtime/light.js").Light} Light */
/**
 * A light that two sliders change. Angles are in degrees.
 * @typedef {object} Movable
 * @property {[around: number, height: number]} own angles of the package's own light
 * @property {(around: number, height: number) => Light} at
 * @property {(around: number) => string} side
 */

/** One line on the light that is drawn; empty without precomputed light. @param {import("../runtime/fidelity.js").Fidelity | null} record */
export function lightLine(record) {
  return record?.light ? LINES[record.light] : "";
}

/**
 * Shows the controls if a program has a light that can be changed.
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {any} manifest
 * @param {() => void} changed told when the light is elsewhere
 */
export function lightControls({ renderer }, manifest, changed) {
  /** The light that the user chose. @type {Light} */
  let moved = null;
  const put = async (/** @type {Light} */ light) => {
    moved = light;
    await renderer.setLight(light);
    changed();
  };
  const controls = {
    isMoved: () => moved !== null,
    /** Puts the light back, and gives what changes it again. */
    takeBack: async () => {
      const before = moved;
      if (before) await put(null);
      return () => before && put(before);
    },
  };
  const light = withPlace(manifest) ?? turning(manifest);
  if (light) sliders(light, put);
  return controls;
}

/** @param {Movable} light @param {(light: Light) => Promise<void>} put */
function sliders(light, put) {
  const [around, height] = [byId("light-around"), byId("light-height")];
  const text = () => {
    byId("light-around-text").value = `${around.value}°${light.side(around.value)}`;
    byId("light-height-text").value = `${height.value}°`;
  };
  const reset = () => {
    [around.value, height.value] = light.own;
    text();
  };
  const move = () => {
    text();
    put(light.at(Number(around.value), Number(height.value))).catch(showProblem);
  };
  for (const each of [around, height]) each.addEventListener("input", move);
  byId("light-reset").addEventListener("click", () => {
    reset();
    put(null).catch(showProblem);
  });
  reset();
  byId("light").hidden = false;
}

/** A light with a place, which moves on a sphere around the volume. @param {any} manifest @returns {Movable | null} */
function withPlace({ programs, grid }) {
  const light = programs.find((/** @type {any} */ program) => program.light)?.light;
  if (!light) return null;
  const { centre, diagonal } = middle(grid);
  const away = light.place_mm_xyz.map((/** @type {number} */ each, /** @type {number} */ axis) => each - centre[axis]);
  const own = Math.hypot(...away);
  // These shadows need a view of the whole volume from the light.
  const distance = ["map", "half-angle"].includes(light.shadows) ? Math.max(own, OUTSIDE * diagonal) : own;
  return {
    // The patient's x goes to the left, y to the back, z to the head.
    own: [Math.atan2(away[0], -away[1]) / DEGREE, own ? Math.asin(away[2] / own) / DEGREE : 0],
    at: (around, height) => {
      const [a, h] = [around * DEGREE, height * DEGREE];
      const to = [Math.sin(a) * Math.cos(h), -Math.cos(a) * Math.cos(h), Math.sin(h)];
      return to.map((each, axis) => centre[axis] + distance * each);
    },
    side: (around) => (Math.abs(around) <= 90 ? ", in front" : ", behind"),
  };
}

/** Light around the volume: its front is raised, then turned around the patient. @param {any} manifest @returns {Movable | null} */
function turning({ textures }) {
  if (!textures.some((/** @type {any} */ texture) => texture.light?.model.turnable)) return null;
  return {
    own: [0, 0],
    at: (angle, height) => {
      const [a, h] = [angle * DEGREE, height * DEGREE];
      const [sin, cos] = [Math.sin(a), Math.cos(a)];
      const [up, level] = [Math.sin(h), Math.cos(h)];
      return { turn: [cos, -sin * level, -sin * up, sin, cos * level, cos * up, 0, -up, level] };
    },
    side: () => "",
  };
}
