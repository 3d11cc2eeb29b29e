/** How the page writes numbers: as the report does. */

const SUPERSCRIPT = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/**
 * A number with three significant digits; below 0.0001 as a power of ten.
 * @param {number} value
 * @param {number} [digits]
 */
export function number(value, digits = 3) {
  if (value === 0) return "0";
  const magnitude = Math.floor(Math.log10(Math.abs(value)));
  if (magnitude < -4) {
    const power = [...String(-magnitude)].map((value) => SUPERSCRIPT[Number(value)]).join("");
    return `${(value / 10 ** magnitude).toFixed(digits - 1)}·10⁻${power}`;
  }
  return value.toFixed(Math.max(0, digits - 1 - magnitude));
}

/** @param {number} count of bytes */
export function bytes(count) {
  if (count < 1000) return `${count} B`;
  const units = ["kB", "MB", "GB"];
  let value = count / 1000;
  let unit = 0;
  while (value >= 999.5 && unit < 2) [value, unit] = [value / 1000, unit + 1];
  return `${number(value)} ${units[unit]}`;
}

/** @param {readonly number[]} zyx sizes as people write them, x first */
export const voxels = (zyx) => [...zyx].reverse().join("×");

/** @param {number} share */
export const percent = (share) => `${number(100 * share, 2)} %`;
