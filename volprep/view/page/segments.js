/** Segments of the scan: a list in which each is shown, hidden, or shown alone, and their names under the mouse. */
import { byId, make } from "./dom.js";
import { hoverNames } from "./hover.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";
import { css } from "./srgb.js";

/** From here on a list can be searched. */
const MANY = 8;

/**
 * Shows the list if the package has segments.
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {any} manifest
 * @param {() => void} changed called when a segment looks different
 */
export function segmentControls(stage, manifest, changed) {
  const { renderer } = stage;
  /** Visibility that differs from the package's, by name. @type {Map<string, boolean>} */
  const other = new Map();
  /** @type {{name: string, title?: string, visible?: boolean, tint?: number[], volume_ml: number}[]} */
  const segments = manifest.segments?.segments ?? [];
  const boxes = segments.map((segment) => make("input", { type: "checkbox", checked: segment.visible !== false }));
  const apply = async () => {
    segments.forEach(({ name, visible = true }, i) =>
      boxes[i].checked === visible ? other.delete(name) : other.set(name, boxes[i].checked),
    );
    await renderer.setSegments(segments.map(({ name }, i) => [name, { visible: boxes[i].checked }])).catch(showProblem);
    changed();
  };
  /** @param {(index: number) => boolean} shown */
  const choose = (shown) => {
    boxes.forEach((box, i) => (box.checked = shown(i)));
    return apply();
  };
  const controls = {
    isChanged: () => other.size > 0,
    state: () => [...other],
    /** Shows and hides as a link says. @param {[string, boolean][]} state */
    show: async (state) => {
      const wanted = new Map(state);
      if (wanted.size) await choose((i) => wanted.get(segments[i].name) ?? segments[i].visible !== false);
    },
    /** Shows what the package shows, and gives what changes it again. */
    takeBack: async () => {
      const before = new Map(other);
      if (before.size) await choose((i) => segments[i].visible !== false);
      return () => before.size && choose((i) => before.get(segments[i].name) ?? segments[i].visible !== false);
    },
  };
  if (!segments.length) return controls;
  const rows = segments.map((each, i) => {
    boxes[i].addEventListener("change", apply);
    const only = make("button", { type: "button", title: `Show only ${titleOf(each)}` }, "only");
    only.addEventListener("click", () => choose((other) => other === i));
    const swatch = make("i", { className: "swatch" });
    swatch.style.background = css(each.tint ?? [1, 1, 1]);
    const label = make(
      "label",
      {},
      boxes[i],
      swatch,
      make("span", {}, titleOf(each)),
      make("small", {}, `${number(each.volume_ml)} ml`),
    );
    return make("li", {}, label, only);
  });
  const search = make("input", { type: "search", placeholder: "Search segments", "aria-label": "Search segments" });
  const noneFound = make("p", { hidden: true }, "No segment has this in its name.");
  search.addEventListener("input", () => {
    const wanted = search.value.trim().toLowerCase();
    rows.forEach((row, i) => (row.hidden = !titleOf(segments[i]).toLowerCase().includes(wanted)));
    noneFound.hidden = rows.some((row) => !row.hidden);
  });
  const [all, none] = [true, false].map((is) => {
    const button = make("button", { type: "button" }, is ? "Show all" : "Hide all");
    button.addEventListener("click", () => choose(() => is));
    return button;
  });
  const parts = [make("div", { className: "row" }, all, none), make("ul", { className: "segments" }, ...rows)];
  byId("segments-body").replaceChildren(...(segments.length > MANY ? [search, ...parts, noneFound] : parts));
  byId("segments").hidden = false;
  hoverNames(stage, byId("frame"), new Map(segments.map((segment) => [segment.name, titleOf(segment)])));
  return controls;
}

/** Names of files have underscores for spaces. @param {{name: string, title?: string}} segment */
const titleOf = ({ name, title }) => (title ?? name).replaceAll("_", " ");
