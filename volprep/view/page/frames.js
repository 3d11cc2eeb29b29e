/** Frames of a time series: a slider, and a button that plays them in their own time. Late frames are skipped. */
import { byId, make } from "./dom.js";
import { number } from "./numbers.js";
import { showProblem } from "./problems.js";

/** Seconds from frame to frame where the package does not say when they were taken. */
const PACE_S = 0.1;
const SPEEDS = [0.25, 0.5, 1, 2, 4];

/** Shows the controls if the package is a time series. @param {import("../runtime/stage.js").Stage} stage */
export function frameControls({ renderer }) {
  const { frames = [] } = renderer.package.manifest;
  if (!frames.length) return { state: () => 0, show: () => {} };
  const last = frames.length - 1;
  const isTimed = frames.every(({ time_s: time }) => time !== undefined);
  const times = frames.map(({ time_s: time = 0 }, k) => (isTimed ? time - (frames[0].time_s ?? 0) : k * PACE_S));
  // The last frame is seen as long as the one before it.
  const length = last ? 2 * times[last] - times[last - 1] : PACE_S;
  const slider = make("input", { type: "range", min: 0, max: last, value: 0, "aria-label": "Frame" });
  const told = make("output");
  const play = make("button", { type: "button", "aria-pressed": "false" }, "Play");
  const options = SPEEDS.map((speed) => make("option", { value: speed, selected: speed === 1 }, `${speed}×`));
  const speed = make("select", { "aria-label": "Speed" }, ...options);
  /** The place in time where playing began, and the clock then; null while it rests. @type {{at: number, clock: number} | null} */
  let begun = null;
  const show = async () => {
    const { time_s: seconds } = frames[slider.valueAsNumber];
    told.textContent = `frame ${slider.value}${seconds === undefined ? "" : `, ${number(seconds)} s`}`;
    await renderer.setFrame(slider.valueAsNumber).catch(showProblem);
  };
  const now = () => ({ at: times[slider.valueAsNumber], clock: performance.now() });
  const begin = () => (begun &&= now());
  const step = async () => {
    if (!begun) return;
    const at = (begun.at + ((performance.now() - begun.clock) / 1000) * Number(speed.value)) % length;
    const later = times.findIndex((time) => time > at);
    const frame = (later < 0 ? frames.length : later) - 1;
    if (frame !== slider.valueAsNumber) {
      slider.value = String(frame);
      await show();
    }
    requestAnimationFrame(step);
  };
  slider.addEventListener("input", () => {
    begin();
    show();
  });
  speed.addEventListener("change", begin);
  play.addEventListener("click", () => {
    begun = begun ? null : now();
    play.setAttribute("aria-pressed", String(!!begun));
    play.textContent = begun ? "Pause" : "Play";
    step();
  });
  byId("time-body").replaceChildren(make("div", { className: "row" }, play, speed, slider), told);
  byId("time").hidden = false;
  show();
  return {
    state: () => slider.valueAsNumber,
    /** Shows the frame of a link. @param {number} frame */
    show: (frame) => {
      slider.value = String(frame);
      return show();
    },
  };
}
