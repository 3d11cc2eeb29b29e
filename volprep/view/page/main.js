/** The page: opens the package, draws it, and adds the controls. */
import { invert, moved } from "../runtime/camera.js";
import "../runtime/element.js";
import { words } from "../runtime/fidelity.js";
import { FIRST_VIEW } from "../runtime/stage.js";
import { accuracy } from "./accuracy.js";
import { contents } from "./contents.js";
import { cutControls } from "./cut.js";
import { byId, make } from "./dom.js";
import { functionEditor } from "./editor.js";
import { json, packageSource, settings } from "./files.js";
import { frameControls } from "./frames.js";
import { lightControls, lightLine } from "./light.js";
import { linkControls } from "./link.js";
import { lookControls } from "./look.js";
import { mediaControls } from "./media.js";
import { measureControls } from "./measure.js";
import { pointControls } from "./points.js";
import { lend } from "./lent_renderer.js";
import { bytes, number, voxels } from "./numbers.js";
import { showProblem } from "./problems.js";
import { segmentControls } from "./segments.js";
import { sliceControls } from "./slices.js";
import { rendererOf, showSlices } from "./slices_page.js";

/** Part of the picture that a standard view of the volume fills. */
const FILLED = 0.92;
const VIEWS = {
  anterior: "the front",
  posterior: "behind",
  left: "the patient's left",
  right: "the patient's right",
  superior: "above",
  inferior: "below",
  "anterior-left": "the front, left and above",
  "anterior-right": "the front, right and above",
  "posterior-left": "behind, left and below",
};

async function start() {
  const told = await settings();
  const viewer = byId("picture");
  viewer.options = { create: rendererOf, relight: true };
  await opened(viewer, packageSource(told.package));
  const { package: pack, stage } = viewer;
  const { manifest } = pack;
  document.title = `${manifest.name} · volprep view`;
  byId("title").textContent = manifest.name;
  byId("subtitle").textContent = subtitle(manifest);
  byId("contents-body").replaceChildren(...contents(manifest));
  viewControls(stage);
  toggle("annotations", viewer);
  if (manifest.profile.api === "es1.1") showSlices(stage, pack);
  else await showVolume(viewer, told);
  // For tests, and for the console.
  Object.assign(window, { volprep: { stage, pack } });
}

/** Adds the controls of a volume. @param {any} viewer @param {import("./files.js").Settings} told */
async function showVolume(viewer, told) {
  const { stage } = viewer;
  const { manifest } = viewer.package;
  const report = told.report ? await json(told.report).catch(() => null) : null;
  const look = lookControls(stage, manifest, () => changed());
  const editor = functionEditor(stage, manifest, byId("function"), told.opaque_lengths_mm, () => changed());
  const cut = cutControls(
    stage,
    manifest,
    () => changed(),
    (plane, share) => slices.put(plane, share),
  );
  const media = mediaControls(stage, manifest, () => changed());
  const light = lightControls(stage, manifest, () => changed());
  const segments = segmentControls(stage, manifest, () => changed());
  const slices = sliceControls(viewer, manifest, cut.follow);
  // On a phone one of these is open at a time, so that the page stays short.
  if (matchMedia("(max-width: 899px)").matches)
    for (const id of ["segments", "look", "slices"]) if (!byId(id).hidden) byId(id).name = "card";
  let picture = stage.renderer.program;
  const changed = async () => {
    const { renderer } = stage;
    if (picture !== renderer.program) {
      editor.show();
      media.show();
    }
    picture = renderer.program;
    slices.show();
    // The report has the views of the first frame.
    if (report && renderer.frame) byId("error").replaceChildren("The report measures the first frame here.");
    else if (report) {
      const now = {
        transfer: renderer.program,
        level: renderer.level,
        step: renderer.step,
        edited: editor.isEdited() || media.isFaded(),
        lit: light.isMoved(),
        segments: segments.isChanged(),
        cut: cut.isCut(),
      };
      byId("error").replaceChildren(...accuracy(report, now));
    }
    const record = await renderer.fidelity(viewer.measured);
    byId("fidelity").textContent = record && (record.bricks || record.source !== "unknown") ? words(record) : "";
    byId("light-line").textContent = lightLine(record);
  };
  stage.renderer.addEventListener("change", () => {
    look.levels();
    changed();
  });
  stage.gl.canvas.addEventListener("webglcontextrestored", () => showProblem(null));
  await linkControls(stage, [look, frameControls(stage), cut, segments, { state: media.state, show: media.restore }]);
  toggle("ruler", viewer, "measuring");
  pointControls(viewer);
  if (told.truth && report) {
    measureControls(byId("measure"), told, {
      lend: (work) => undisturbed(stage, [editor, media, cut, light, segments], look, report.picture_size, work),
      tolerance: report.tolerance.rmse,
      measured: (record) => {
        viewer.measured = record;
        changed();
      },
    });
  }
  changed();
}

/** Measures the package as it is: without edits, without cuts, and with the controls locked. @param {import("../runtime/stage.js").Stage} stage @param {{takeBack: () => Promise<() => unknown>}[]} changes @param {{lock: (is: boolean) => void}} look @param {number} size @param {(bench: any) => Promise<any>} work */
async function undisturbed(stage, changes, look, size, work) {
  const again = [];
  look.lock(true);
  try {
    await stage.renderer.ready;
    for (const change of changes) again.push(await change.takeBack());
    return await lend(stage, size, work);
  } finally {
    for (const redo of again) await redo();
    look.lock(false);
  }
}

/**
 * Opens the package; resolves with the first picture. Errors, now and later, are shown over the picture.
 * @param {import("../runtime/element.js").VolumeViewer} viewer @param {string | Blob} source
 */
function opened(viewer, source) {
  return new Promise((resolve) => {
    viewer.addEventListener("load", resolve, { once: true });
    viewer.addEventListener("error", (event) => {
      event.preventDefault();
      showProblem(/** @type {any} */ (event).detail);
    });
    viewer.open(source);
  });
}

/**
 * A button that sets an attribute of the viewer, or takes it away.
 * @param {string} id of the button @param {HTMLElement} viewer @param {string} [attribute]
 */
function toggle(id, viewer, attribute = id) {
  const button = byId(id);
  button.addEventListener("click", () => {
    button.setAttribute("aria-pressed", String(viewer.toggleAttribute(attribute)));
  });
  button.disabled = false;
}

/** @param {import("../runtime/stage.js").Stage} stage */
function viewControls(stage) {
  const from = byId("from");
  from.append(...Object.entries(VIEWS).map(([name, text]) => make("option", { value: name }, `Seen from ${text}`)));
  from.value = FIRST_VIEW;
  from.addEventListener("change", () => from.value && stage.look(from.value));
  stage.onview = (name) => {
    from.value = name;
    if (name) fill(stage);
  };
  from.disabled = false;
  fill(stage);
  const full = byId("fullscreen");
  full.hidden = !document.fullscreenEnabled;
  full.addEventListener("click", () => byId("frame").requestFullscreen().catch(showProblem));
}

/** Makes the volume as large as the picture. @param {import("../runtime/stage.js").Stage} stage */
function fill({ orbit, renderer, gl }) {
  const { clientWidth, clientHeight } = gl.canvas;
  const aspect = clientWidth / clientHeight || 1;
  const [ez, ey, ex] = renderer.grid.extent_mm_zyx;
  orbit.zoom = Math.min(aspect, 1);
  const clipFromBox = invert(orbit.boxFromClip(aspect, renderer.grid));
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => moved(clipFromBox, [i & 1 && ex, i & 2 && ey, i & 4 && ez]));
  orbit.zoom = FILLED / Math.max(...corners.flatMap(([x, y]) => [Math.abs(x), Math.abs(y)]));
}

/** @param {any} manifest */
function subtitle(manifest) {
  const { info } = manifest.channels[0].source;
  const size = manifest.files.reduce((/** @type {number} */ sum, /** @type {any} */ each) => sum + each.size_bytes, 0);
  const extent = [...manifest.grid.extent_mm_zyx]
    .reverse()
    .map((value) => number(value))
    .join(" × ");
  return `${info.modality || info.format}, ${voxels(manifest.grid.shape_zyx)} voxels, ${extent} mm; package of ${bytes(size)} for ${manifest.profile.name}`;
}

start().catch(showProblem);
