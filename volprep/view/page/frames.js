/** Frames of a time series: a slider, and a button that plays them in their own time. */
import { byId, make } from "./dom.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";

/** Milliseconds from frame to frame where the package does not say when they were taken. */
const PACE = 100;

/**
 * Shows the controls if the package is a time series.
 * @param {import("../runtime/stage.js").Stage} stage
 */
export function frameControls({ renderer }) {
  const { frames = [] } = renderer.package.manifest;
  if (!frames.length) return;
  const slider = make("input", { type: "range", min: 0, max: frames.length - 1, value: 0, "aria-label": "Frame" });
  const told = make("output");
  const play = make("button", { type: "button", "aria-pressed": "false" }, "Play");
  let isPlaying = false;
  const show = async () => {
    const { time_s: seconds } = frames[slider.valueAsNumber];
    told.textContent = `frame ${slider.value}${seconds === undefined ? "" : `, ${number(seconds)} s`}`;
    await renderer.setFrame(slider.valueAsNumber).catch(showProblem);
  };
  const step = async () => {
    if (!isPlaying) return;
    const began = performance.now();
    const next = (slider.valueAsNumber + 1) % frames.length;
    const [before, now] = [frames[next - 1]?.time_s, frames[next].time_s];
    const pause = before === undefined || now === undefined ? PACE : 1000 * (now - before);
    slider.value = String(next);
    await show();
    setTimeout(step, pause - (performance.now() - began));
  };
  slider.addEventListener("input", show);
  play.addEventListener("click", () => {
    isPlaying = !isPlaying;
    play.setAttribute("aria-pressed", String(isPlaying));
    play.textContent = isPlaying ? "Pause" : "Play";
    step();
  });
  byId("time-body").replaceChildren(make("div", { className: "buttons" }, play, slider), told);
  byId("time").hidden = false;
  show();
}
