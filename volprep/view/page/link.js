/** A link to the picture on the screen: view, picture, frame, cut and hidden segments, behind the # of the address. */
import { cross, dot, middle, unit } from "../runtime/camera.js";
import { byId } from "./dom.js";
import { showProblem } from "./problems.js";

const KEY = "#look=";

/**
 * The button that makes the link; shows the state in the link of this page.
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {{state: () => unknown, show: (state: any) => unknown}[]} parts that a link holds beside the view
 */
export async function linkControls(stage, parts) {
  const button = byId("link");
  button.addEventListener("click", async () => {
    const state = [viewOf(stage), ...parts.map((part) => part.state())];
    history.replaceState(null, "", KEY + encodeURIComponent(JSON.stringify(state)));
    await navigator.clipboard?.writeText(location.href).catch(() => {});
    button.textContent = "In the address";
    setTimeout(() => (button.textContent = "Link"), 2000);
  });
  button.disabled = false;
  if (!location.hash.startsWith(KEY)) return;
  try {
    const [view, ...states] = JSON.parse(decodeURIComponent(location.hash.slice(KEY.length)));
    for (const [k, each] of parts.entries()) await each.show(states[k]);
    look(stage, view);
  } catch (error) {
    showProblem(new Error(`The link does not fit this package: ${error instanceof Error ? error.message : error}`));
  }
}

/** Direction, zoom, and how far the middle of the picture is from that of the volume, in heights of the picture. @param {import("../runtime/stage.js").Stage} stage */
function viewOf({ orbit, renderer }) {
  const { eye, forward, up, height } = orbit.camera;
  const beside = eye.map((at, axis) => at - middle(renderer.grid).centre[axis]);
  const right = unit(cross(unit(forward), up));
  return { forward, up, zoom: orbit.zoom, pan: [right, up].map((axis) => -dot(beside, axis) / height) };
}

/** @param {import("../runtime/stage.js").Stage} stage @param {ReturnType<typeof viewOf>} view */
function look(stage, { forward, up, zoom, pan }) {
  if (![...forward, ...up, ...pan, 1 / zoom].every(Number.isFinite)) throw new Error("it holds no view");
  stage.orbit.aim(forward, up, zoom);
  stage.orbit.pan(pan[0], pan[1]);
  stage.onview("");
  stage.redraw();
}
