/** The browser's side of the notebook widget: keeps a `<volume-viewer>` and the traits of a model equal. */
import { make } from "./page/dom.js";
import { linkedSlices } from "./page/slice_view.js";
import "./runtime/element.js";

const REST_MS = 150;
const FLAGS = ["controls", "measuring", "annotations", "fidelity"];

function bytesOf(view) {
  return new Uint8Array(view.buffer, view.byteOffset, view.byteLength);
}

function render({ model, el }) {
  const end = new AbortController();
  const viewer = document.createElement("volume-viewer");
  // The volume has the width of its cell, whatever the element's own size.
  Object.assign(viewer.style, { width: "100%", maxWidth: `${model.get("width")}px` });
  const put = (name, value) => {
    if (JSON.stringify(model.get(name)) === JSON.stringify(value)) return;
    model.set(name, value);
    model.save_changes();
  };
  const attribute = (name, value) => {
    if (value) viewer.setAttribute(name, value);
    else viewer.removeAttribute(name);
  };
  const fail = (error) => put("error", String(error?.message ?? error));
  const slices = make("div", { className: "volprep-slices" });
  slices.style.maxWidth = viewer.style.maxWidth;
  const segments = make("details", { className: "volprep-segments" });
  const follow = {
    slices: () => slices.replaceChildren(...(viewer.renderer && model.get("slices") ? slicesOf(viewer, fail) : [])),
    segments: () => {
      const { renderer } = viewer;
      if (!renderer) return;
      const looks = model.get("segments");
      const names = new Set([...renderer.segments.map(({ name }) => name), ...Object.keys(looks)]);
      renderer.setSegments([...names].map((name) => [name, looks[name] ?? null])).then(() => put("error", ""), fail);
      for (const box of segments.querySelectorAll("input"))
        box.checked = looks[box.name]?.visible ?? box.defaultChecked;
    },
    view: () => {
      const view = model.get("view");
      // "" means that the volume was turned by hand; the camera has the direction.
      if (!view) return;
      if (viewer.renderer) viewer.stage.look(view);
      else viewer.setAttribute("view", view);
    },
    camera: () => {
      const { stage, renderer } = viewer;
      const camera = model.get("camera");
      if (!renderer || !camera || same(camera, cameraOf(stage))) return;
      put("view", "");
      stage.orbit.aim(camera.forward, camera.up, camera.zoom);
      stage.redraw();
    },
    "function": () => attribute("function", model.get("function")),
    clip: () => attribute("clip", (model.get("clip") ?? []).join(" ")),
    background: () => attribute("background", model.get("background")),
    points: () => {
      const points = model.get("points");
      viewer.renderer?.setTransfer(points && { points }).then(() => put("error", ""), fail);
    },
    kept: () => {
      const kept = model.get("kept");
      if (kept?.byteLength) viewer.open(bytesOf(kept).slice());
      else model.send({ wanted: "package" });
    },
  };
  const given = (content, buffers) => {
    if (content?.given === "package" && !end.signal.aborted) viewer.open(bytesOf(buffers[0]).slice());
  };
  for (const name of FLAGS) follow[name] = () => viewer.toggleAttribute(name, model.get(name));

  let rest = 0;
  const moved = (name) => {
    // A standard view is sent at once, a moving camera when it rests.
    clearTimeout(rest);
    if (name) put("view", name);
    rest = setTimeout(() => {
      if (!viewer.stage || end.signal.aborted) return;
      put("view", name);
      put("camera", cameraOf(viewer.stage));
    }, REST_MS);
  };
  viewer.addEventListener("load", () => {
    const { stage } = viewer;
    const inner = stage.onchange;
    stage.onchange = () => {
      inner();
      put("function", stage.renderer.program);
      put("level", stage.renderer.level);
    };
    stage.onview = moved;
    stage.onchange();
    put("error", "");
    if (model.get("points")) follow.points();
    segments.replaceChildren(...segmentBoxes(viewer.package.manifest));
    if (segments.firstChild) follow.segments();
    follow.slices();
    if (model.get("view")) put("camera", cameraOf(stage));
    else follow.camera();
  });
  viewer.addEventListener("error", ({ detail }) => fail(detail));
  const observer = new MutationObserver(() => {
    const clip =
      viewer
        .getAttribute("clip")
        ?.match(/[\d.]+/g)
        ?.map(Number) ?? null;
    if (!clip || clip.length === 6) put("clip", clip);
    for (const name of FLAGS) put(name, viewer.hasAttribute(name));
  });

  for (const name of ["view", "function", "clip", "background", ...FLAGS]) follow[name]();
  viewer.setAttribute("label", model.get("label"));
  const picture = model.get("picture");
  const poster = picture?.byteLength ? URL.createObjectURL(new Blob([bytesOf(picture)], { type: "image/png" })) : "";
  attribute("poster", poster);
  observer.observe(viewer, { attributes: true, attributeFilter: ["clip", ...FLAGS] });
  for (const [name, act] of Object.entries(follow)) model.on(`change:${name}`, act);
  model.on("msg:custom", given);
  segments.addEventListener("change", ({ target: { name, checked } }) => {
    const looks = model.get("segments");
    put("segments", { ...looks, [name]: { ...looks[name], visible: checked } });
    follow.segments();
  });
  el.append(viewer, slices, segments);
  follow.kept();
  return () => {
    end.abort();
    clearTimeout(rest);
    observer.disconnect();
    for (const [name, act] of Object.entries(follow)) model.off(`change:${name}`, act);
    model.off("msg:custom", given);
    for (const part of [viewer, slices, segments]) part.remove();
    if (poster) URL.revokeObjectURL(poster);
  };
}

/** Boxes of three slices with one crosshair. */
function slicesOf({ renderer, package: { manifest } }, failed) {
  const [low, high] = manifest.channels[0].quantization.window;
  const step = (high - low) / 200;
  const values = { level: (low + high) / 2, width: high - low };
  const drag = (across, down) => {
    values.width = Math.max(values.width + across * step, step);
    values.level += down * step;
    for (const view of views) view.paint();
  };
  const { views, read } = linkedSlices(renderer, { now: () => values, drag }, { failed });
  renderer.addEventListener("change", () => views[0].box.isConnected && read());
  read();
  return views.map(({ box }) => box);
}

/** A list with a box for each segment, which shows and hides it. */
function segmentBoxes({ segments }) {
  if (!segments) return [];
  const labels = segments.segments.map(({ name, title, visible = true }) =>
    make("label", {}, make("input", { type: "checkbox", name, defaultChecked: visible }), title ?? name),
  );
  return [make("summary", {}, "Segments"), ...labels];
}

function cameraOf({ orbit }) {
  const { forward, up } = orbit.camera;
  return { forward: [...forward], up: [...up], zoom: orbit.zoom };
}

function same(one, other) {
  const numbers = ({ forward, up, zoom }) => [...forward, ...up, zoom];
  const others = numbers(other);
  return numbers(one).every((each, i) => Math.abs(each - others[i]) < 1e-6);
}

export const widget = { render };
