/** Elements of the page, made from values and never from text that could be markup. */

/** @param {string} id @returns {any} */
export const byId = (id) => document.getElementById(id);

/**
 * @param {string} tag
 * @param {Record<string, unknown>} [properties] of the element; those with a hyphen, and `for`, are attributes
 * @param {...(Node | string)} children
 * @returns {any}
 */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.includes("-") || name === "for" || name === "role") element.setAttribute(name, String(value));
    else Object.assign(element, { [name]: value });
  }
  element.append(...children);
  return element;
}

/**
 * @param {string} tag
 * @param {Record<string, unknown>} [attributes]
 * @param {...(Node | string)} children
 * @returns {any}
 */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/** @param {string} id @param {number} min @param {number} max @param {number} value @param {number} step */
export function slider(id, min, max, value, step) {
  return { input: make("input", { type: "range", id, min, max, step, value }), output: make("output", { for: id }) };
}

/** @param {string} text @param {any} input @param {any} [output] */
export const field = (text, input, output = "") =>
  make("div", { className: "field" }, make("label", { for: input.id }, text), output, input);

/**
 * A table in a box that scrolls sideways.
 * @param {string} caption
 * @param {string[]} headings
 * @param {(Node | string)[][]} rows the first cell of each names it
 * @param {(index: number) => boolean} [isNow] whether a row belongs to the current picture
 */
export function table(caption, headings, rows, isNow = () => false) {
  const head = make("thead", {}, make("tr", {}, ...headings.map((heading) => make("th", { scope: "col" }, heading))));
  const body = rows.map(([first, ...others], index) => {
    const row = make("tr", {}, make("th", { scope: "row" }, first), ...others.map((value) => make("td", {}, value)));
    if (isNow(index)) row.className = "now";
    return row;
  });
  const whole = make("table", {}, make("caption", {}, caption), head, make("tbody", {}, ...body));
  return make("div", { className: "scroll", tabIndex: 0, role: "region", "aria-label": caption }, whole);
}
