/** The colour of the page behind a canvas that is transparent. */

/** @typedef {{colour: number[], note: string}} Page encoded red, green and blue; and a note if it is uncertain */

/** How long a colour that was read holds. */
const FRESH_MS = 1000;
const OPAQUE = { colour: [0, 0, 0], note: "" };
/** @type {WeakMap<object, {at: number, page: Page}>} */
const known = new WeakMap();

/** @param {WebGLRenderingContext | WebGL2RenderingContext} gl @returns {Page} */
export function pageColour(gl) {
  const { canvas } = gl;
  const found = known.get(canvas);
  const now = performance.now();
  if (found && now - found.at < FRESH_MS) return found.page;
  const { alpha, premultipliedAlpha } = gl.getContextAttributes() ?? {};
  const isElement = typeof HTMLCanvasElement !== "undefined" && canvas instanceof HTMLCanvasElement;
  const page = alpha && premultipliedAlpha && isElement && canvas.isConnected ? behind(canvas) : OPAQUE;
  known.set(canvas, { at: now, page });
  return page;
}

/** Background colour by the styles of the elements around a canvas. @param {Element} canvas @returns {Page} */
function behind(canvas) {
  const colour = [0, 0, 0];
  let through = 1;
  let note = "";
  for (let each = /** @type {Element | null} */ (canvas); each && through > 0; each = each.parentElement) {
    const { backgroundColor, backgroundImage } = getComputedStyle(each);
    const srgb = backgroundColor.startsWith("color(srgb");
    const [r = 0, g = 0, b = 0, a = 1] = (backgroundColor.match(/-?[\d.]+(e-?\d+)?/g) ?? [0, 0, 0, 0]).map(Number);
    [r, g, b].forEach((value, i) => (colour[i] += through * a * (srgb ? value : value / 255)));
    if (backgroundImage !== "none")
      note =
        "behind a transparent canvas only the page's colour is known, not its picture: give the scene a background";
    through *= 1 - a;
  }
  // The page itself is white.
  return { colour: colour.map((value) => value + through), note };
}
