/** From cameras of three.js to rays: matrices, and depth of opaque objects as a fraction of the ray. */
import * as THREE from "three";

/** @typedef {import("../core/renderer.js").Depth} Depth */
/**
 * How a camera sees a volume.
 * @typedef {object} Sight
 * @property {THREE.Matrix4} boxFromClip with planes near and far just around the volume, which float32 resolves
 * @property {NonNullable<Depth["scale"]>} scale from depth as the camera writes it
 */

/**
 * A box before a camera.
 * @typedef {object} Seen
 * @property {THREE.Camera} camera
 * @property {THREE.Matrix4} eyeFromBox
 * @property {[number, number]} depths distances of its nearest and farthest corner
 * @property {boolean} reversed whether depth is reversed
 * @property {boolean} logarithmic whether depth is logarithmic
 * @property {boolean} oblique whether the plane near is not parallel to the picture, as mirrors have it
 */

/** Ratio of the nearest to the farthest distance that is drawn: float32 cannot resolve a smaller one. */
const NEAREST = 1e-4;
/** Depth as three.js has it where the near plane is at 1, in place of OpenGL's. */
const REVERSED = new THREE.Matrix4().set(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -0.5, 0.5, 0, 0, 0, 1);

/**
 * @param {THREE.Camera} camera @param {THREE.Matrix4} worldFromBox @param {readonly number[]} size of the box, x, y, z
 * @param {{reversed: boolean, logarithmic: boolean}} depth how the context writes it
 * @returns {Seen}
 */
export function seenBy(camera, worldFromBox, size, depth) {
  const e = camera.projectionMatrix.elements;
  const eyeFromBox = camera.matrixWorldInverse.clone().multiply(worldFromBox);
  const all = corners(size).map((corner) => -corner.applyMatrix4(eyeFromBox).z);
  const depths = /** @type {[number, number]} */ ([Math.min(...all), Math.max(...all)]);
  return { camera, eyeFromBox, depths, ...depth, oblique: e[2] !== 0 || e[6] !== 0 };
}

/**
 * How a camera sees a box, or a layer of it; null where no part of it lies between its planes.
 * @param {Seen} seen @param {readonly [number, number]} [layer] least and largest distance
 * @returns {Sight | null}
 */
export function sightOf({ camera, eyeFromBox, depths, reversed, logarithmic, oblique }, layer = [-Infinity, Infinity]) {
  const projection = camera.projectionMatrix;
  const e = projection.elements;
  const perspective = e[11] !== 0;
  // The camera's own planes stay.
  if (oblique) {
    const boxFromClip = projection.clone().multiply(eyeFromBox).invert();
    if (reversed) boxFromClip.multiply(REVERSED);
    return { boxFromClip, scale: [-2, 1, 0] };
  }
  const [near, far] = planesOf(e, perspective, reversed);
  const [least, most] = depths;
  const margin = 1e-3 * (most - least);
  const last = Math.min(far, most + margin, layer[1]);
  const first = Math.max(near, least - margin, layer[0], perspective ? NEAREST * last : -Infinity);
  if (!(last > first)) return null;
  const fitted = projection.clone();
  const [slope, offset] = perspective
    ? [-(last + first) / (last - first), (-2 * last * first) / (last - first)]
    : [-2 / (last - first), -(last + first) / (last - first)];
  fitted.elements[10] = slope;
  fitted.elements[14] = offset;
  const boxFromClip = fitted.multiply(eyeFromBox).invert();
  if (!perspective) {
    // Distance is near + depth · (far − near), and far − (1 − depth) · (far − near).
    return { boxFromClip, scale: [slope * (far - near), -slope * far + offset, 0] };
  }
  // The clip coordinate is −slope + offset / distance; 1 / distance is linear in depth, or in 2^(log2 · depth) − 1.
  if (logarithmic) return { boxFromClip, scale: [offset, -slope, Math.log2(far + 1)] };
  const inverse = Number.isFinite(far) ? 1 / far : 0;
  return { boxFromClip, scale: [offset * (1 / near - inverse), -slope + offset * inverse, 0] };
}

/**
 * Distances of the planes near and far, as a projection has them.
 * @param {readonly number[]} e elements of the matrix @param {boolean} perspective @param {boolean} reversed
 */
function planesOf(e, perspective, reversed) {
  const [a, b] = [e[10], e[14]];
  // Where depth is reversed, 1 is near and 0 far; else −1 is near and 1 far.
  const [near, far] = reversed ? [1, 0] : [-1, 1];
  const at = (/** @type {number} */ depth) => (perspective ? b / (depth + a) : (b - depth) / a);
  const [first, last] = [at(near), at(far)];
  return [first, last > first ? last : Infinity];
}

/** @param {readonly number[]} size */
function corners([x, y, z]) {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((n) => new THREE.Vector3(n & 1 ? x : 0, n & 2 ? y : 0, n & 4 ? z : 0));
}
