/** Half floats from numbers. */

/** Bits of the half float that is nearest to a number from 0 to 65504. @param {number} value */
export function toHalf(value) {
  if (value < 2 ** -14) return even(value * 2 ** 24);
  const exponent = Math.min(Math.floor(Math.log2(value)), 15);
  // A fraction that rounds up to 1024 carries into the exponent, as it should.
  return ((exponent + 15) << 10) + even((value / 2 ** exponent - 1) * 1024);
}

/** @param {number} value to the nearest whole number, half to even */
function even(value) {
  const down = Math.floor(value);
  const rest = value - down;
  return rest > 0.5 || (rest === 0.5 && down % 2) ? down + 1 : down;
}
