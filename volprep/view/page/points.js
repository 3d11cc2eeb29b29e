/** Points of the ruler as a list with their uncertainty, which is saved and loaded as JSON. */
import { pointsRecord, readPoints } from "../runtime/points.js";
import { distance, words } from "../runtime/ruler.js";
import { byId, make } from "./dom.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";

/** @param {any} viewer the element */
export function pointControls(viewer) {
  const { stage } = viewer;
  const save = byId("points-save");
  const show = () => {
    const { points, renderer } = stage;
    const lines = points.map((/** @type {any} */ point, /** @type {number} */ i) => {
      const { apart, uncertainty } = distance(points[i - 1] ?? point, point);
      const away = i ? `${number(apart)} ± ${number(uncertainty)} mm from point ${i}; ` : "";
      return make("li", {}, away + words(point, renderer.segments));
    });
    byId("points-list").replaceChildren(...lines);
    save.disabled = !points.length;
    byId("points").hidden = !points.length && !viewer.hasAttribute("measuring");
  };
  viewer.addEventListener("pick", show);
  byId("ruler").addEventListener("click", show);
  save.addEventListener("click", () => {
    const text = JSON.stringify(pointsRecord(stage), null, 2);
    const href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
    make("a", { href, download: `${viewer.package.manifest.name}.points.json` }).click();
    setTimeout(() => URL.revokeObjectURL(href), 10_000);
  });
  const file = byId("points-file");
  byId("points-load").addEventListener("click", () => file.click());
  file.addEventListener("change", async () => {
    try {
      readPoints(stage, await file.files[0].text());
      showProblem(null);
    } catch (error) {
      showProblem(error);
    }
    file.value = "";
    show();
  });
  show();
}
