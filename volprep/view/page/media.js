/** How much each channel is seen of a picture whose channels lie on several grids, and a mix of two of them. */
import { byId, make } from "./dom.js";
import { mediaOf } from "./fusion.js";
import { showProblem } from "./problems.js";

/** @typedef {{transfer: string, input: any}} Fade a function, and its slider from 0 to 1 */

/**
 * Shows a slider for each channel below the functions, as long as such a picture is drawn.
 * @param {import("../runtime/stage.js").Stage} stage
 * @param {any} manifest
 * @param {() => void} changed
 */
export function mediaControls({ renderer }, manifest, changed) {
  /** Opacities that the user chose, by function. @type {Map<string, number>} */
  const faded = new Map();
  const place = make("div");
  byId("function").after(place);
  const put = (/** @type {string} */ transfer, /** @type {number} */ opacity) => {
    if (opacity === 1 && !faded.delete(transfer)) return null;
    if (opacity !== 1) faded.set(transfer, opacity);
    return renderer.setTransfer(opacity === 1 ? null : { opacity }, transfer).catch(showProblem);
  };
  const set = async (/** @type {Fade[]} */ fades) => {
    for (const { transfer, input } of fades) await put(transfer, input.valueAsNumber);
    changed();
  };
  const show = () => {
    const fades = mediaOf(manifest, renderer.program).map(({ transfer }) => {
      const value = faded.get(transfer) ?? 1;
      return { transfer, input: range(`opacity of ${transfer}`, value) };
    });
    for (const fade of fades) fade.input.addEventListener("input", () => set([fade]));
    const fields = fades.map(({ transfer, input }) => field(transfer, input));
    if (fades.length === 2) fields.push(mix(fades, set));
    place.replaceChildren(...(fields.length ? [make("fieldset", {}, make("legend", {}, "Opacity"), ...fields)] : []));
  };
  show();
  return {
    show,
    /** Opacity of a function. @param {string} transfer */
    opacityOf: (transfer) => faded.get(transfer) ?? 1,
    isFaded: () => faded.size > 0,
    state: () => [...faded],
    /** Fades as a link says. @param {[string, number][]} [state] */
    restore: async (state = []) => {
      for (const [transfer, opacity] of state) await put(transfer, Number(opacity));
      show();
    },
    takeBack: async () => {
      const kept = [...faded];
      for (const [transfer] of kept) await renderer.setTransfer(null, transfer);
      return async () => {
        for (const [transfer, opacity] of kept) await renderer.setTransfer({ opacity }, transfer);
      };
    },
  };
}

/** A slider that shows one of two channels at its ends, and both in the middle. @param {Fade[]} fades @param {(fades: Fade[]) => void} set */
function mix(fades, set) {
  const [first, second] = fades.map(({ input }) => input);
  const input = range(`mix of ${fades[0].transfer} and ${fades[1].transfer}`, 0.5);
  input.addEventListener("input", () => {
    const share = input.valueAsNumber;
    first.value = String(Math.min(1, 2 - 2 * share));
    second.value = String(Math.min(1, 2 * share));
    set(fades);
  });
  return field("mix", input);
}

/** @param {string} name @param {number} value */
const range = (name, value) => make("input", { type: "range", min: 0, max: 1, step: 0.05, value, "aria-label": name });

/** @param {string} name @param {any} input */
const field = (name, input) => make("label", { className: "pair" }, name, input, make("span"));
