/**
 * `<volume-viewer src="head.volpkg.zip" poster="head.png" controls>`: a package in a page, as an image or a video is.
 *
 * Attributes: `src`; `poster`, a picture until the volume is there; `controls`, which lets people turn it and shows
 * tools; `view`, a standard view; `function`, a transfer function; `frame`, of a time series; `background`, "#rrggbb";
 * `clip`, six numbers from 0 to 1 of the box, its low corner and its high one (x, y, z); `auto-rotate`, degrees a
 * second; `measuring`, which reads out the point under the pointer and the distance between two points; `annotations`,
 * letters of the patient's directions and a scale bar; `fidelity`, the known error of the picture; `label`, its name
 * for screen readers.
 *
 * Events: `load`, `progress` (`detail`: loaded, total), `levelchange` (level), `pick` (a Hit), `error` (code, summary,
 * remedy; shown unless its default is prevented). Parts for styles: canvas, poster, status, tools, function, button,
 * marks, annotations, fidelity.
 */
import { VolpkgError } from "./core/error.js";
import { openPackage } from "./core/package.js";
import { addStyle } from "./element/sheet.js";
import { FIRST_VIEW, Stage } from "./element/stage.js";

/** @typedef {import("./core/package.js").Package} Package */
/** @typedef {import("./core/package.js").OpenOptions} OpenOptions */
/** @typedef {import("./element/element_tools.js").Tools} Tools */

const STYLE = `:host { display: block; position: relative; aspect-ratio: 4 / 3; background: #000; color: #fff; }
canvas, img { position: absolute; width: 100%; height: 100%; object-fit: contain; }
p { position: absolute; left: 0; right: 0; bottom: 0; margin: 0; padding: 6px; background: #000c; }
p:empty { display: none; }`;

/** Attributes that show tools. */
const TOOLS = /** @type {const} */ (["controls", "measuring", "annotations", "fidelity"]);

/** A volume package in a page. */
export class VolumeViewer extends HTMLElement {
  static observedAttributes = [
    ..."src poster view function frame background clip auto-rotate label".split(" "),
    ...TOOLS,
  ];
  /**
   * For `openPackage` and `createRenderer`: headers, fetch, decodeDraco; set it before `src`.
   * @type {OpenOptions & NonNullable<Parameters<Stage["start"]>[0]>}
   */
  options = {};
  /** A measurement of this device, for `fidelity`. @type {import("./core/fidelity.js").Measured | undefined} */
  measured;
  /** The open package. @type {Package | null} */
  package = null;
  #canvas = document.createElement("canvas");
  #poster = document.createElement("img");
  #status = document.createElement("p");
  #root;
  /** @type {Stage | null} */
  #stage = null;
  /** @type {Tools | null} */
  #tools = null;
  #end = new AbortController();
  #turning = new AbortController();
  #level = -1;
  /** Argument of the last `open`; undefined if it was the attribute `src`. @type {Parameters<typeof openPackage>[0] | null | undefined} */
  #given;
  #isBegun = false;

  constructor() {
    super();
    this.#root = this.attachShadow({ mode: "open" });
    addStyle(this.#root, STYLE);
    this.#poster.setAttribute("part", "poster");
    this.#poster.alt = "";
    this.#status.setAttribute("part", "status");
    this.#status.setAttribute("role", "status");
    this.#root.append(this.#canvas, this.#poster, this.#status);
  }

  /** Everything that can be changed; null until the first picture. */
  get renderer() {
    return this.#stage?.renderer ?? null;
  }

  /** The canvas, its camera and how it draws; null until a package is open. */
  get stage() {
    return this.#stage;
  }

  connectedCallback() {
    // A page may put the element where it shall be after `open`, and move it, which closes the package.
    if (!this.#isBegun) this.open(this.#given);
  }

  disconnectedCallback() {
    this.#close();
  }

  /** @param {string} name @param {string | null} before @param {string | null} value */
  attributeChangedCallback(name, before, value) {
    if (!this.isConnected || before === value) return;
    if (name === "src") this.open();
    else if (name === "poster" || name === "label") this.#dress();
    else if (this.renderer) this.#apply(name);
  }

  #close() {
    this.#end.abort();
    this.#turning.abort();
    this.#tools?.remove();
    this.#stage?.dispose();
    this.package?.close();
    this.#tools = this.#stage = this.package = null;
    this.#level = -1;
    this.#isBegun = false;
  }

  /**
   * Opens a package and draws it, in place of the one before.
   * @param {Parameters<typeof openPackage>[0] | null} [given] argument of `openPackage`; the attribute `src` if absent
   */
  async open(given) {
    this.#close();
    this.#given = given;
    this.#isBegun = true;
    const src = given === undefined ? this.getAttribute("src") : given;
    const { signal } = (this.#end = new AbortController());
    // A context that was lost stays so: each package gets a canvas of its own.
    const canvas = document.createElement("canvas");
    this.#canvas.replaceWith(canvas);
    this.#canvas = canvas;
    this.#dress();
    if (!src) return;
    const onProgress = (/** @type {import("./core/package.js").Progress} */ at) => {
      const notes = () => this.renderer?.notes.join(" ") ?? "";
      this.#say(at.loaded < at.total ? `loading ${Math.floor((100 * at.loaded) / at.total)} %` : notes());
      this.#tell("progress", at);
    };
    try {
      const pack = await openPackage(src, { onProgress, ...this.options, signal });
      this.package = pack;
      const stage = new Stage(canvas, pack, (error) => this.#fail(error));
      this.#stage = stage;
      const program = this.#programOf(pack);
      await stage.start({ ...this.options, ...(program && { program }), signal });
      stage.onchange = () => this.#levels();
      stage.ondraw = () => this.#tools?.drawn();
      for (const name of ["background", "view", "clip", "frame", "auto-rotate", "controls"]) this.#apply(name);
      this.#poster.hidden = true;
      this.#levels();
      canvas.addEventListener("webglcontextlost", () => this.#say("The graphics are lost."));
      canvas.addEventListener("webglcontextrestored", () => this.#say(""));
      this.#tell("load");
      await stage.renderer.ready;
      this.#say(stage.renderer.notes.join(" "));
    } catch (error) {
      if (!signal.aborted) this.#fail(error);
    }
  }

  /** @param {Package} pack */
  #programOf(pack) {
    const name = this.getAttribute("function");
    if (!name || pack.programs.some((program) => program.name === name)) return name;
    this.#wrong("function", `the package has ${pack.programs.map((program) => program.name).join(", ")}`);
    return null;
  }

  /** Follows an attribute. @param {string} name */
  #apply(name) {
    const stage = /** @type {Stage} */ (this.#stage);
    const value = this.getAttribute(name);
    const fail = (/** @type {string} */ reason) => this.#wrong(name, reason);
    if (name === "view") {
      if (!stage.look(value || FIRST_VIEW)) fail(`views are ${stage.orbit.views.join(", ")}`);
    } else if (name === "function") {
      const program = this.#programOf(/** @type {Package} */ (this.package));
      if (program) stage.renderer.setProgram(program).catch((error) => this.#fail(error));
    } else if (name === "background") {
      const found = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(value || "#000000");
      if (found) stage.backdrop = found.slice(1).map((value) => parseInt(value, 16) / 255);
      else fail("it is no #rrggbb");
    } else if (name === "clip") {
      const numbers = (value?.match(/[^\s,]+/g) ?? []).map(Number);
      const isBox = numbers.every((each, i) => each >= 0 && each <= 1 && (i > 2 || each < numbers[i + 3]));
      if (value && !(numbers.length === 6 && isBox)) fail("it is no box: six numbers from 0 to 1");
      else if (value || this.#level >= 0) this.#cut(numbers);
    } else if (name === "frame") {
      if (value) stage.renderer.setFrame(Number(value)).catch((error) => this.#fail(error));
    } else if (name === "auto-rotate") this.#rotate(value);
    else this.#equip();
  }

  /** @param {number[]} share of the box, its low corner and its high one */
  #cut(share) {
    const { renderer } = /** @type {Stage} */ (this.#stage);
    const size = [...renderer.grid.extent_mm_zyx].reverse();
    const corner = (/** @type {number} */ at) => size.map((each, i) => each * share[at + i]);
    renderer
      .setClip(share[0] === undefined ? null : { box: [corner(0), corner(3)] })
      .catch((error) => this.#fail(error));
  }

  /** Turns it, or ends that. @param {string | null} degrees a second */
  async #rotate(degrees) {
    this.#turning.abort();
    if (!degrees) return;
    const { signal } = (this.#turning = new AbortController());
    const { rotate } = await import("./element/rotate.js");
    if (this.#stage && !signal.aborted && !rotate(this.#stage, Number(degrees), signal))
      this.#wrong("auto-rotate", "it is no number of degrees a second");
  }

  /** Shows tools, or takes them away. */
  async #equip() {
    const stage = this.#stage;
    const isWanted = () => TOOLS.some((tool) => this.hasAttribute(tool));
    const found = isWanted() ? await import("./element/element_tools.js") : null;
    if (!stage || this.#stage !== stage) return;
    this.#tools?.remove();
    this.#tools = null;
    // Another attribute may have come meanwhile.
    if (!found || !isWanted()) return;
    const then = {
      say: (/** @type {string} */ text) => this.#say(text),
      pick: (/** @type {unknown} */ hit) => this.#tell("pick", hit),
      fail: (/** @type {unknown} */ error) => this.#fail(error),
      measured: () => this.measured,
    };
    this.#tools = new found.Tools(this.#root, this.#canvas, stage, (name) => this.hasAttribute(name), then);
  }

  #dress() {
    const poster = this.getAttribute("poster");
    this.#poster.hidden = !poster || this.#level >= 0;
    if (poster) this.#poster.src = poster;
    const canvas = this.#canvas;
    canvas.setAttribute("part", "canvas");
    const isActive = this.hasAttribute("controls");
    canvas.tabIndex = isActive ? 0 : -1;
    canvas.setAttribute("role", isActive ? "application" : "img");
    canvas.setAttribute(
      "aria-label",
      this.getAttribute("label") ?? (isActive ? "The volume. Arrow keys turn it." : "The volume"),
    );
  }

  #levels() {
    const level = this.renderer?.level ?? -1;
    if (level === this.#level) return;
    this.#level = level;
    this.#tell("levelchange", { level });
  }

  /** @param {string} name @param {string} reason */
  async #wrong(name, reason) {
    await import("./core/messages.js");
    this.#fail(new VolpkgError("VP7081", { name, value: JSON.stringify(this.getAttribute(name)), reason }));
  }

  /** @param {any} error */
  #fail(error) {
    if (this.#tell("error", error)) this.#say(error?.message ?? String(error));
  }

  /** @param {string} text */
  #say(text) {
    if (this.#status.textContent === text) return;
    this.#status.textContent = text;
    this.#tools?.placed();
  }

  /** @param {string} type @param {unknown} [detail] */
  #tell(type, detail) {
    return this.dispatchEvent(new CustomEvent(type, { detail, cancelable: true }));
  }
}

if (!customElements.get("volume-viewer")) customElements.define("volume-viewer", VolumeViewer);
