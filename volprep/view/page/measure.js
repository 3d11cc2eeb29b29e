/** The part of the page that measures this device, shows the result, and sends or saves it. */
import { STEADY, errorAgainstTime, spread } from "./chart.js";
import { make, table } from "./dom.js";
import { measure } from "./measuring.js";
import { bytes, number, percent } from "./numbers.js";
import { PageError, problem } from "./problems.js";

/**
 * @param {HTMLElement} place
 * @param {import("./files.js").Settings} settings
 * @param {{lend: (work: (bench: any) => Promise<any>) => Promise<any>, tolerance: number | null, measured: (record: any) => void}} page
 */
export function measureControls(place, settings, { lend, tolerance, measured }) {
  const button = make("button", { type: "button", className: "main" }, "Measure");
  const result = make("div", { role: "status", "aria-live": "polite" });
  const goes = settings.devices
    ? "The result is sent to the volprep that serves this page."
    : "The result stays here; you can save it as a file.";
  place.replaceChildren(
    make(
      "p",
      { className: "hint" },
      "Draws nine views, and steps and levels from coarse to fine, on this device: how wrong is each, and how fast? It takes a minute at most. Keep this page in front. ",
      goes,
    ),
    make("div", { className: "row" }, button),
    result,
  );
  button.addEventListener("click", async () => {
    button.disabled = true;
    const stop = new AbortController();
    const bar = make("progress", { max: 1, value: 0, "aria-label": "Measurement" });
    const what = make("p", { className: "hint" });
    const cancel = make("button", { type: "button" }, "Stop");
    cancel.addEventListener("click", () => stop.abort());
    result.replaceChildren(bar, what, make("div", { className: "row" }, cancel));
    const progress = (/** @type {number} */ share, /** @type {string} */ text) => {
      bar.value = share;
      what.textContent = text;
    };
    try {
      const record = await lend((bench) => measure(bench, settings, { progress, signal: stop.signal }));
      result.replaceChildren(...shown(record, tolerance));
      measured(record);
      await deliver(record, settings, result);
    } catch (error) {
      const stopped = stop.signal.aborted;
      result.replaceChildren(
        stopped
          ? make("p", { className: "hint" }, "Stopped; nothing was kept.")
          : make("div", { className: "problem", role: "alert" }, ...problem(error)),
      );
    }
    button.disabled = false;
    button.textContent = "Measure again";
  });
}

/** @param {any} record @param {number | null} tolerance */
function shown(record, tolerance) {
  const { device, programs, throttling, timing, picture_size: size } = record;
  const slower = throttling.first_ms ? throttling.last_ms / throttling.first_ms - 1 : 0;
  const unsteady = programs
    .flatMap((/** @type {any} */ program) => program.points)
    .filter((/** @type {any} */ value) => spread(value) > STEADY).length;
  const notes = [
    slower > STEADY
      ? `This device became ${percent(slower)} slower while it was measured: it throttles, and later times are too long.`
      : "",
    unsteady
      ? `${unsteady} of the times vary by more than ${percent(STEADY)} from the fastest to the slowest; they are drawn hollow and marked *.`
      : "",
    ...record.left_out.map((/** @type {string} */ value) => `Not measured: ${value}.`),
  ].filter(Boolean);
  const facts = [
    ["GPU", device.gpu],
    ["Browser", `${device.browser}, ${device.platform}, ${device.api === "webgl2" ? "WebGL 2" : "WebGL 1"}`],
    ["Pictures", `${size} × ${size} pixels`],
    ["Timed by", timing === "fence" ? "waiting for many draws" : "the GPU's own clock"],
    ["Took", `${number(record.seconds)} s`],
  ];
  const probes = record.probes.map((/** @type {any} */ probe) =>
    make(
      "li",
      {},
      make("b", {}, probe.name),
      `: ${probe.passed ? "works" : "no"}`,
      make("span", { className: "why" }, probe.note),
    ),
  );
  return [
    ...programs.flatMap((/** @type {any} */ program) => curveOf(program, tolerance, programs.length > 1)),
    ...notes.map((each) => make("p", { className: "note" }, each)),
    make("dl", {}, ...facts.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)])),
    make(
      "details",
      {},
      make("summary", {}, "What this device can do, as tried"),
      make("ul", { className: "plan" }, ...probes),
    ),
  ];
}

/** @param {any} program @param {number | null} tolerance @param {boolean} titled */
function curveOf(program, tolerance, titled) {
  const { points, views, transfer } = program;
  const worst = views.reduce(
    (/** @type {any} */ most, /** @type {any} */ each) => (each.rmse > most.rmse ? each : most),
    views[0],
  );
  const rows = points.map((/** @type {any} */ point) => [
    `${point.level}`,
    number(point.step_mm),
    `${number(point.draw_ms)}${spread(point) > STEADY ? " *" : ""}`,
    percent(spread(point)),
    number(point.rmse),
  ]);
  return [
    ...(titled ? [make("h3", {}, transfer)] : []),
    ...(points.length
      ? [errorAgainstTime(points, { tolerance, title: `Error against time of ${transfer} on this device` })]
      : []),
    ...(worst
      ? [
          make(
            "p",
            { className: "hint" },
            `Worst of ${views.length} views: ${worst.view}, RMSE ${number(worst.rmse)}, largest ${number(worst.maximum)}.`,
          ),
        ]
      : []),
    make(
      "details",
      {},
      make("summary", {}, "As a table"),
      table(
        `Error against time of ${transfer}, view ${program.sweep_view}`,
        ["level", "step, mm", "ms", "spread", "RMSE"],
        rows,
      ),
    ),
  ];
}

/** Sends the measurement, if the server takes it; it can be saved in any case. @param {any} record @param {import("./files.js").Settings} settings @param {HTMLElement} place */
async function deliver(record, settings, place) {
  const text = `${JSON.stringify(record, null, 2)}\n`;
  const blob = new Blob([text], { type: "application/json" });
  const save = make(
    "a",
    { href: URL.createObjectURL(blob), download: `${record.package.name}.device.json` },
    `Save as a file (${bytes(blob.size)})`,
  );
  place.append(make("p", {}, save));
  if (!settings.devices) return;
  const told = make("p", { className: "hint" }, "sending …");
  place.append(told);
  try {
    const answer = await fetch(settings.devices, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: text,
    });
    const said = await answer.json().catch(() => ({}));
    if (!answer.ok)
      throw new PageError("VP7043", {
        reason: said.code ? `${said.code} ${said.summary}` : `the server answers ${answer.status}`,
      });
    told.textContent = `Sent to volprep, which stored it as ${said.file}.`;
  } catch (error) {
    const reason =
      error instanceof PageError ? error : new PageError("VP7043", { reason: /** @type {Error} */ (error).message });
    told.replaceWith(make("div", { className: "problem", role: "alert" }, ...problem(reason)));
  }
}
