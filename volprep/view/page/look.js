/** Choices of the picture: function, level, step, background. */
import { drawingOf } from "../runtime/fidelity.js";
import { byId, make } from "./dom.js";
import { isColour } from "./editor.js";
import { bytes, number, voxels } from "./numbers.js";
import { showProblem } from "./problems.js";

/** Value of the choice of no level. */
const BRICKS = "bricks";
/** @type {Record<string, string>} */
const BACKGROUNDS = { black: "#000000", white: "#ffffff" };
/** Steps of the slider for a factor of two. */
const NOTCHES = 4;
const [FINEST, COARSEST] = [-3 * NOTCHES, 3 * NOTCHES];

/**
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {any} manifest
 * @param {() => void} changed called when the picture changes
 */
export function lookControls(stage, manifest, changed) {
  const { renderer } = stage;
  const [transfer, level, step] = ["transfer", "level", "step"].map(byId);
  transfer.replaceChildren(
    ...renderer.programs.map(({ name, together }) =>
      make("option", { value: name }, together ? `${name} (${joined(manifest, name)})` : named(manifest, name)),
    ),
  );
  transfer.value = renderer.program;
  transfer.disabled = renderer.programs.length < 2;
  Object.assign(step, { min: FINEST, max: COARSEST, step: 1, value: 0, disabled: false });
  /** Each level has a step of its own, and the slider is a factor for it. */
  let packageStep = renderer.packageStep;
  const setStep = () => {
    packageStep = renderer.packageStep;
    renderer.setStep(Number(step.value) ? packageStep * 2 ** (step.value / NOTCHES) : undefined);
  };
  /** The bricks that are drawn, or were before a level was chosen. */
  let bricks = /** @type {any} */ (null);
  const levels = () => {
    const drawn = renderer.inside?.drawn.choice.bricks;
    bricks = drawn ?? bricks;
    const now = wantedLevel === null && drawn ? BRICKS : String(wantedLevel ?? renderer.level);
    level.replaceChildren(
      ...(bricks ? [make("option", { value: BRICKS }, "bricks, as the view needs them")] : []),
      ...renderer.levels.map((index) => make("option", { value: index }, levelText(manifest, index))),
    );
    level.value = now;
    level.disabled = level.length < 2;
    if (packageStep === renderer.packageStep) return;
    setStep();
    stepText();
  };
  let wantedLevel = /** @type {number | null} */ (null);
  const stepText = () => {
    const ratio = 2 ** (step.value / NOTCHES);
    const times = Number(step.value)
      ? `${ratio > 1 ? number(ratio, 2) : `1⁄${number(1 / ratio, 2)}`} × the package's`
      : "as the package asks";
    const text = `${number(renderer.step)} mm, ${times}`;
    byId("step-text").value = text;
    step.setAttribute("aria-valuetext", text);
  };
  const choose = async () => {
    const drawn = renderer.inside?.drawn.choice.bricks;
    await renderer.setProgram(transfer.value).catch(showProblem);
    if (drawn) await renderer.setPoint(/** @type {any} */ (drawn)).catch(showProblem);
    levels();
    changed();
  };
  transfer.addEventListener("change", choose);
  level.addEventListener("change", async () => {
    if (level.value === BRICKS) await renderer.setPoint(bricks).catch(showProblem);
    else await renderer.setLevel((wantedLevel = Number(level.value))).catch(showProblem);
    wantedLevel = null;
    levels();
    changed();
  });
  step.addEventListener("input", () => {
    try {
      setStep();
      showProblem(null);
    } catch (error) {
      showProblem(error);
    }
    stepText();
    changed();
  });
  backgroundControl();
  levels();
  stepText();
  return {
    levels,
    state: () => transfer.value,
    /** Shows the picture of a link. @param {string} name */
    show: (name) => {
      if (name === transfer.value) return;
      transfer.value = name;
      if (!transfer.value) {
        transfer.value = renderer.program;
        throw new Error("it has no such picture");
      }
      return choose();
    },
    lock: (/** @type {boolean} */ is) =>
      [transfer, level, step].forEach((each) => (each.disabled = is || (each !== step && each.length < 2))),
  };
}

/** The choice of a background. */
export function backgroundControl() {
  const background = byId("background");
  background.addEventListener("change", () => {
    byId("picture").setAttribute("background", BACKGROUNDS[background.value]);
    byId("frame").classList.toggle("white", background.value === "white");
  });
}

/** Contents of a picture of several transfer functions. @param {any} manifest @param {string} name */
function joined(manifest, name) {
  if (name === manifest.segments?.name) return "the scan with its segments";
  return isColour(manifest, name) ? "each voxel in its own" : "all channels together";
}

/** A transfer function by name, with its channel where there are several. @param {any} manifest @param {string} name */
function named(manifest, name) {
  const channel = manifest.channels.find((/** @type {any} */ channel) =>
    channel.transfer_functions.some((/** @type {any} */ one) => one.name === name),
  );
  return manifest.channels.length > 1 && channel ? `${name} (channel ${channel.name})` : name;
}

/** @param {any} manifest @param {number} index */
function levelText(manifest, index) {
  const level = manifest.channels[0].levels.find((/** @type {any} */ level) => level.index === index);
  const drawing = drawingOf(manifest, index);
  const size = drawing ? `, ${bytes(drawing.cost.upload_bytes)}` : "";
  const use = drawing?.preview_only ? ", for previews" : "";
  return `${index}${index === 0 ? " (finest)" : ""}: ${voxels(level.grid.shape_zyx)}${size}${use}`;
}
