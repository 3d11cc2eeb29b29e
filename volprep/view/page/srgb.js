/** Colours of style sheets, which are sRGB, and linear light. */

/** @param {readonly number[]} colour linear, 0 to 1 @returns {string} #rrggbb */
export function css(colour) {
  const encoded = colour.map((each) => (each <= 0.0031308 ? 12.92 * each : 1.055 * each ** (1 / 2.4) - 0.055));
  return `#${encoded
    .map((each) =>
      Math.round(Math.min(Math.max(each, 0), 1) * 255)
        .toString(16)
        .padStart(2, "0"),
    )
    .join("")}`;
}

/** @param {string} text #rrggbb @returns {[number, number, number]} linear, 0 to 1 */
export function linear(text) {
  const one = (/** @type {number} */ at) => {
    const value = parseInt(text.slice(at, at + 2), 16) / 255;
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  };
  return [one(1), one(3), one(5)];
}
