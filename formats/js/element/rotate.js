/** A volume that turns by itself. */

/**
 * Turns until the signal. Who asks for less motion gets none that was not asked for.
 * @param {import("./stage.js").Stage} stage @param {number} degrees a second @param {AbortSignal} signal
 * @returns {boolean} whether it is a number
 */
export function rotate(stage, degrees, signal) {
  if (!Number.isFinite(degrees)) return false;
  if (!degrees || matchMedia("(prefers-reduced-motion: reduce)").matches) return true;
  let last = performance.now();
  const turn = (/** @type {number} */ now) => {
    if (signal.aborted) return;
    stage.orbit.turn(Math.min(now - last, 100) * degrees * (Math.PI / 180_000), 0);
    stage.moving();
    last = now;
    requestAnimationFrame(turn);
  };
  requestAnimationFrame(turn);
  return true;
}
