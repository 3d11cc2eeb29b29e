/** Tools of `<volume-viewer>`: gestures, a bar with functions and buttons, a ruler, annotations, the picture's fidelity. */
import { Annotations } from "./annotations.js";
import { fidelityOf, words } from "../core/fidelity.js";
import { listen } from "./gestures.js";
import { Ruler } from "./ruler.js";
import { addStyle } from "./sheet.js";

/** @typedef {import("./stage.js").Stage} Stage */
/**
 * Callbacks of the element.
 * @typedef {{say: (text: string) => void, pick: (hit: import("../draw/pick.js").Hit | null) => void, fail: (error: unknown)
 *   => void, measured: () => import("../core/fidelity.js").Measured | undefined}} Then
 */

/** With what the element itself needs only for tools. */
const STYLE = `canvas { touch-action: none; }
canvas:focus-visible { outline: 3px solid #6cf; outline-offset: -3px; }
[role=toolbar] { position: absolute; top: 0; left: 0; right: 0; display: flex; gap: 6px; padding: 6px;
  flex-wrap: wrap; }
[role=toolbar] > * { min-height: 32px; padding: 0 10px; border: 1px solid #888; border-radius: 6px;
  background: #222; color: #fff; font: inherit; }
[role=toolbar] > :focus-visible { outline: 3px solid #6cf; }
[part=status], [part=fidelity] { box-sizing: border-box; max-height: 40%; overflow: auto; overflow-wrap: anywhere; }
[part=fidelity] { bottom: auto; right: auto; max-width: 100%; padding: 2px 8px; font-size: 12px; pointer-events: none; }`;

/** The tools of one element. */
export class Tools {
  /** @type {Element[]} */
  #parts = [];
  #stage;
  #bar = document.createElement("div");
  #ruler;
  #annotations;
  /** Text of the picture's fidelity. @type {HTMLElement | null} */
  #fidelity = null;
  #then;
  #canvas;
  #status;
  #end = new AbortController();

  /**
   * @param {ShadowRoot} root @param {HTMLCanvasElement} canvas @param {Stage} stage
   * @param {(name: "controls" | "measuring" | "annotations" | "fidelity") => boolean} wants @param {Then} then
   */
  constructor(root, canvas, stage, wants, then) {
    const [controls, measuring] = [wants("controls"), wants("measuring")];
    this.#stage = stage;
    this.#then = then;
    this.#canvas = canvas;
    this.#status = /** @type {HTMLElement} */ (root.querySelector("[part=status]"));
    this.#end.signal.addEventListener("abort", addStyle(root, STYLE));
    const bar = this.#bar;
    if (controls || measuring) this.#parts.push(bar);
    this.#ruler = measuring ? new Ruler(canvas, stage, this.#end.signal, then) : null;
    if (this.#ruler) this.#parts.push(this.#ruler.marks);
    this.#annotations = wants("annotations") ? new Annotations(canvas, stage) : null;
    if (this.#annotations) this.#parts.push(this.#annotations.marks);
    if (wants("fidelity")) {
      this.#fidelity = document.createElement("p");
      this.#fidelity.setAttribute("part", "fidelity");
      this.#parts.push(this.#fidelity);
    }
    for (const [name, value] of Object.entries({ role: "toolbar", part: "tools", "aria-label": "Picture" }))
      bar.setAttribute(name, value);
    const reset = () => stage.look();
    const save = () => stage.picture().then(download, then.fail);
    if (controls) {
      const { programs } = stage.renderer;
      if (programs.length > 1) bar.append(functions(stage, then.fail));
      bar.append(button("Reset view", reset), button("Save picture", save));
      listen(canvas, stage.orbit, { moved: () => stage.moving(), reset, save }, this.#end.signal);
    }
    if (this.#ruler) bar.append(button("Clear points", () => this.#ruler?.clear()));
    root.append(...this.#parts);
    stage.redraw();
  }

  /** Follows a new picture. */
  drawn() {
    this.#ruler?.place();
    if (this.#fidelity) {
      const record = fidelityOf(this.#stage.renderer, this.#then.measured());
      const text = record ? words(record) : "";
      if (this.#fidelity.textContent !== text) this.#fidelity.textContent = text;
      this.#fidelity.style.top = `${this.#bar.offsetHeight}px`;
    }
    this.placed();
  }

  /** Puts letters and bar where no text is. */
  placed() {
    const above = this.#bar.offsetHeight + (this.#fidelity?.offsetHeight ?? 0);
    const { offsetTop, offsetHeight } = this.#status;
    // Keys reach everything that scrolls.
    this.#status.tabIndex = this.#status.scrollHeight > this.#status.clientHeight ? 0 : -1;
    this.#annotations?.place(above, offsetHeight && this.#canvas.clientHeight - offsetTop);
  }

  remove() {
    this.#end.abort();
    if (this.#ruler) this.#then.say("");
    for (const part of this.#parts) part.remove();
  }
}

/** The picture of a canvas as a PNG file. @param {HTMLCanvasElement} canvas @returns {Promise<Blob>} */
export function pngOf(canvas) {
  return new Promise((resolve, reject) => {
    const refused = new Error("the browser makes no PNG file of the picture");
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(refused)));
  });
}

/** @param {Stage} stage @param {(error: unknown) => void} fail */
function functions({ renderer }, fail) {
  const select = document.createElement("select");
  select.setAttribute("part", "function");
  select.setAttribute("aria-label", "Transfer function");
  select.append(...renderer.programs.map(({ name }) => new Option(name)));
  select.value = renderer.program;
  select.addEventListener("change", () => renderer.setProgram(select.value).catch(fail));
  return select;
}

/** @param {string} text @param {() => void} act */
function button(text, act) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  made.setAttribute("part", "button");
  made.addEventListener("click", act);
  return made;
}

/** @param {Blob} blob */
function download(blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = "volume.png";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
