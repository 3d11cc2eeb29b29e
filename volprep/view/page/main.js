/** The page: opens the package, draws it, and puts together what stands beside the picture. */
import { openPackage } from "../runtime/volpkg.js";
import { accuracy } from "./accuracy.js";
import { contents } from "./contents.js";
import { cutControls } from "./cut.js";
import { byId, make } from "./dom.js";
import { functionEditor } from "./editor.js";
import { json, packageSource, settings } from "./files.js";
import { listen } from "./gestures.js";
import { lightControls } from "./light.js";
import { lookControls } from "./look.js";
import { measureControls } from "./measure.js";
import { bytes, number, voxels } from "./numbers.js";
import { showProblem } from "./problems.js";
import { FIRST_VIEW, Stage } from "./stage.js";

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

/** What was loaded is told until nothing has come for so long. */
const QUIET_MS = 700;

async function start() {
  const told = await settings();
  const status = byId("status");
  status.textContent = "opening the package …";
  let loaded = 0;
  const seen = /** @type {Map<string, number>} */ (new Map());
  let quiet = 0;
  let notes = () => "";
  const onProgress = (/** @type {{file: string, loaded: number}} */ at) => {
    loaded += at.loaded - (seen.get(at.file) ?? 0);
    seen.set(at.file, at.loaded);
    status.textContent = `loading: ${bytes(loaded)}`;
    clearTimeout(quiet);
    quiet = setTimeout(() => (status.textContent = notes()), QUIET_MS);
  };
  const pack = await openPackage(packageSource(told.package), { onProgress });
  const { manifest } = pack;
  document.title = `${manifest.name} · volprep view`;
  byId("title").textContent = manifest.name;
  byId("subtitle").textContent = subtitle(manifest);
  byId("contents-body").replaceChildren(...contents(manifest));
  const stage = new Stage(byId("picture"), pack);
  await stage.start();
  notes = () => stage.renderer.notes.join(" ");
  byId("picture").addEventListener("webglcontextlost", () => (status.textContent = "The browser has taken the graphics away; the picture comes back with them."));
  byId("picture").addEventListener("webglcontextrestored", () => (status.textContent = ""));
  const report = told.report ? await json(told.report).catch(() => null) : null;
  const look = lookControls(stage, manifest, () => changed());
  const editor = functionEditor(stage, manifest, byId("function"), () => changed());
  const cut = cutControls(stage, manifest, () => changed());
  const light = lightControls(stage, manifest, () => changed());
  let picture = stage.renderer.program;
  const changed = () => {
    const { renderer } = stage;
    if (picture !== renderer.program) editor.show();
    picture = renderer.program;
    if (report) {
      const now = { transfer: renderer.program, level: renderer.level, step: renderer.step, edited: editor.isEdited(), lit: light.isMoved(), cut: cut.isCut() };
      byId("error").replaceChildren(...accuracy(report, now));
    }
  };
  stage.onchange = () => {
    look.levels();
    changed();
  };
  cameraControls(stage);
  if (told.truth && report) {
    measureControls(byId("measure"), told, { lend: (work) => undisturbed(stage, [editor, cut, light], look, report.picture_size, work), tolerance: report.tolerance.rmse });
  }
  changed();
  // For tests and for who opens the console: what draws.
  Object.assign(window, { volprep: { stage, pack } });
}

/** Measures the package as it is: without edits, without cuts, and with the controls locked. @param {Stage} stage @param {{takeBack: () => Promise<() => unknown>}[]} changes @param {{lock: (is: boolean) => void}} look @param {number} size @param {(bench: any) => Promise<any>} work */
async function undisturbed(stage, changes, look, size, work) {
  const again = [];
  look.lock(true);
  try {
    await stage.renderer.ready;
    for (const each of changes) again.push(await each.takeBack());
    return await stage.lend(size, work);
  } finally {
    for (const each of again) await each();
    look.lock(false);
  }
}

/** @param {Stage} stage */
function cameraControls(stage) {
  const from = byId("from");
  from.append(...Object.entries(VIEWS).map(([name, text]) => make("option", { value: name }, `Seen from ${text}`)));
  from.value = FIRST_VIEW;
  const moved = () => {
    from.value = "";
    stage.moving();
  };
  const look = (/** @type {string} */ name) => {
    stage.orbit.look(name);
    stage.redraw();
    from.value = name;
  };
  const save = async () => {
    try {
      const link = make("a", { href: URL.createObjectURL(await stage.picture()), download: `${byId("title").textContent}.png` });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    } catch (error) {
      showProblem(error);
    }
  };
  from.addEventListener("change", () => from.value && look(from.value));
  byId("reset").addEventListener("click", () => look(FIRST_VIEW));
  byId("save").addEventListener("click", save);
  listen(byId("picture"), stage.orbit, { moved, reset: () => look(FIRST_VIEW), save });
  for (const each of [from, byId("reset"), byId("save")]) each.disabled = false;
}

/** @param {any} manifest */
function subtitle(manifest) {
  const { info } = manifest.channels[0].source;
  const size = manifest.files.reduce((/** @type {number} */ sum, /** @type {any} */ each) => sum + each.size_bytes, 0);
  const extent = [...manifest.grid.extent_mm_zyx].reverse().map((each) => number(each)).join(" × ");
  return `${info.modality || info.format}, ${voxels(manifest.grid.shape_zyx)} voxels, ${extent} mm; package of ${bytes(size)} for ${manifest.profile.name}`;
}

start().catch((error) => {
  byId("status").textContent = "";
  showProblem(error);
});
