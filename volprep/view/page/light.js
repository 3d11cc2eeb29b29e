/** Where the light is, in packages that are lit from a place. */
import { middle } from "../runtime/camera.js";
import { byId } from "./dom.js";
import { showProblem } from "./problems.js";

const DEGREE = Math.PI / 180;
/** Share of the volume's diagonal that is outside of it in every direction. */
const OUTSIDE = 0.55;

/**
 * Shows the controls if a program has such a light. The light moves on a sphere around the volume.
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {any} manifest
 * @param {() => void} changed told when the light is elsewhere
 */
export function lightControls({ renderer }, manifest, changed) {
  const light = manifest.programs.find((/** @type {any} */ each) => each.light)?.light;
  /** Where the light was moved to. @type {number[] | null} */
  let moved = null;
  const put = async (/** @type {number[] | null} */ place) => {
    moved = place;
    await renderer.setLight(place);
    changed();
  };
  const controls = {
    isMoved: () => moved !== null,
    /** Puts the light back, and gives what moves it again. */
    takeBack: async () => {
      const before = moved;
      if (before) await put(null);
      return () => before && put(before);
    },
  };
  if (!light) return controls;
  const { centre, diagonal } = middle(manifest.grid);
  const away = light.place_mm_xyz.map((/** @type {number} */ each, /** @type {number} */ axis) => each - centre[axis]);
  const own = Math.hypot(...away);
  // These shadows need a view of the whole volume from the light.
  const distance = ["map", "half-angle"].includes(light.shadows) ? Math.max(own, OUTSIDE * diagonal) : own;
  const [around, height] = [byId("light-around"), byId("light-height")];
  const text = () => {
    byId("light-around-text").value = `${around.value}°, ${Math.abs(around.value) <= 90 ? "in front" : "behind"}`;
    byId("light-height-text").value = `${height.value}°`;
  };
  const reset = () => {
    // The patient's x goes to the left, y to the back, z to the head.
    around.value = Math.atan2(away[0], -away[1]) / DEGREE;
    height.value = own ? Math.asin(away[2] / own) / DEGREE : 0;
    text();
  };
  const move = () => {
    const [a, h] = [around.value * DEGREE, height.value * DEGREE];
    const to = [Math.sin(a) * Math.cos(h), -Math.cos(a) * Math.cos(h), Math.sin(h)];
    text();
    put(to.map((each, axis) => centre[axis] + distance * each)).catch(showProblem);
  };
  for (const each of [around, height]) each.addEventListener("input", move);
  byId("light-reset").addEventListener("click", () => {
    reset();
    put(null).catch(showProblem);
  });
  reset();
  byId("light").hidden = false;
  return controls;
}
