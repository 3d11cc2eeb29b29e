/** Ambient occlusion on a grid of cubic cells: light from 26 directions, each in one sweep over the cells. */

/**
 * Weights of a neighbour by how many axes it is away along: Lebedev's rule with 26 points (1976), which is exact for
 * polynomials up to degree 7 on the sphere.
 */
const WEIGHTS = [0, 1 / 21, 4 / 105, 9 / 280];
const OFFSETS = [-1, 0, 1].flatMap((z) => [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((x) => [x, y, z])));
const DIRECTIONS = OFFSETS.filter((offset) => offset.some(Boolean));

/**
 * Sweeps one direction after the other; the light is complete after the last.
 * @param {Float32Array} extinction of each cell, per millimetre, x fastest
 * @param {readonly number[]} shape cells along x, y and z @param {number} cellMm length of an edge
 * @param {number} [reachMm] matter farther away blocks no light
 * @returns {Generator<Float32Array, void>} the part of the sky that each cell sees, as far as it is summed
 */
export function* sweeps(extinction, shape, cellMm, reachMm = Infinity) {
  const light = new Float32Array(extinction.length);
  const depth = new Float32Array(extinction.length);
  for (const direction of DIRECTIONS) {
    sweep(extinction, shape, direction, cellMm, reachMm, { light, depth });
    yield light;
  }
}

/**
 * Adds the light that travels along one direction to the middle of each cell.
 * @param {Float32Array} extinction @param {readonly number[]} shape @param {readonly number[]} direction
 * @param {number} cellMm @param {number} reachMm @param {{light: Float32Array, depth: Float32Array}} sums
 */
function sweep(extinction, [nx, ny, nz], [dx, dy, dz], cellMm, reachMm, { light, depth }) {
  const axes = Math.abs(dx) + Math.abs(dy) + Math.abs(dz);
  const [weight, stepMm] = [WEIGHTS[axes], cellMm * Math.sqrt(axes)];
  const back = (dz * ny + dy) * nx + dx;
  const steps = Math.max(1, Math.round(reachMm / stepMm));
  const along = (/** @type {number} */ d, /** @type {number} */ n, /** @type {number} */ k) => (d < 0 ? n - 1 - k : k);
  const inside = (/** @type {number} */ at, /** @type {number} */ n) => at >= 0 && at < n;
  for (let k = 0; k < nz; k++) {
    const z = along(dz, nz, k);
    for (let j = 0; j < ny; j++) {
      const y = along(dy, ny, j);
      const [near, far] = [1, steps].map((n) => inside(z - n * dz, nz) && inside(y - n * dy, ny));
      for (let i = 0; i < nx; i++) {
        const x = along(dx, nx, i);
        const cell = (z * ny + y) * nx + x;
        depth[cell] = near && inside(x - dx, nx) ? depth[cell - back] + extinction[cell - back] * stepMm : 0;
        const beyond = far && inside(x - steps * dx, nx) ? depth[cell - steps * back] : 0;
        light[cell] += weight * Math.exp(beyond - depth[cell] - 0.5 * extinction[cell] * stepMm);
      }
    }
  }
}
