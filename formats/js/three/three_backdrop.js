/**
 * Opaque objects of a three.js scene: their depth and light, drawn once for all volumes, and kept while it is
 * still.
 */
import * as THREE from "three";

/** The backdrops of each renderer, by camera. @type {WeakMap<THREE.WebGLRenderer, Map<THREE.Camera, Backdrop>>} */
const all = new WeakMap();
/** As many cameras as a cube has sides, and two eyes. */
const MOST = 8;
/** Sorts of objects whose shape three.js changes while it draws. */
const LIVELY = ["isSkinnedMesh", "isBatchedMesh", "isShaderMaterial", "isRawShaderMaterial"];

/** Materials of an object. @param {any} object @returns {THREE.Material[]} */
const materialsOf = (object) => [object.material ?? []].flat();

/**
 * The backdrop of a camera, as it is in this frame.
 * @param {THREE.WebGLRenderer} three @param {THREE.Object3D} scene @param {THREE.Camera} camera
 * @param {THREE.Vector4} viewport
 */
export function backdropOf(three, scene, camera, viewport) {
  const kept = all.get(three) ?? new Map();
  all.set(three, kept);
  const found = kept.get(camera) ?? new Backdrop();
  kept.delete(camera);
  kept.set(camera, found);
  for (const [each, old] of kept) {
    if (kept.size <= MOST) break;
    old.dispose();
    kept.delete(each);
  }
  found.update(three, scene, camera, viewport);
  return found;
}

/** Frees the cache of a renderer; it is redrawn when needed. @param {THREE.WebGLRenderer} three */
export function freeBackdrops(three) {
  for (const each of all.get(three)?.values() ?? []) each.dispose();
  all.delete(three);
}

/** Depth and light of opaque objects for one camera. */
class Backdrop {
  /** @type {THREE.WebGLRenderTarget | null} */
  #target = null;
  /** State of the last drawing, as numbers. @type {number[] | null} */
  #drawn = null;
  #frame = -1;
  /** Counts pictures of it. */
  version = 0;
  /** Depth, from 0 to 1; null where nothing is opaque. @type {WebGLTexture | null} */
  depth = null;

  /** Linear light of opaque objects, where `depth` is not null. */
  get light() {
    return this.#target?.texture ?? null;
  }

  /**
   * @param {THREE.WebGLRenderer} three @param {THREE.Object3D} scene @param {THREE.Camera} camera
   * @param {THREE.Vector4} viewport
   */
  update(three, scene, camera, viewport) {
    if (three.info.render.frame === this.#frame) return;
    const { numbers, count } = contents(scene, camera);
    const now = numbers && [
      ...numbers,
      ...camera.projectionMatrix.elements,
      ...camera.matrixWorld.elements,
      viewport.z,
      viewport.w,
    ];
    const isSame = now && now.length === this.#drawn?.length && now.every((each, i) => each === this.#drawn?.[i]);
    if (!isSame) {
      this.#drawn = now;
      this.version++;
      this.depth = null;
      if (count) this.#draw(three, scene, camera, viewport);
    }
    this.#frame = three.info.render.frame;
  }

  dispose() {
    this.#target?.depthTexture?.dispose();
    this.#target?.dispose();
    this.#target = null;
    this.#drawn = null;
    this.#frame = -1;
  }

  /**
   * Draws opaque objects once more: the canvas's own depth cannot be read.
   * @param {THREE.WebGLRenderer} three @param {THREE.Object3D} scene @param {THREE.Camera} camera
   * @param {THREE.Vector4} viewport
   */
  #draw(three, scene, camera, viewport) {
    this.#target ??= made(three);
    this.#target.setSize(viewport.z, viewport.w);
    const hidden = materials(scene).filter((each) => each.visible && each.transparent);
    for (const each of hidden) each.visible = false;
    const target = three.getRenderTarget();
    const [face, level] = [three.getActiveCubeFace(), three.getActiveMipmapLevel()];
    const [shadows, present, resets] = [three.shadowMap.autoUpdate, three.xr.enabled, three.info.autoReset];
    const { background } = /** @type {THREE.Scene} */ (scene);
    three.shadowMap.autoUpdate = three.xr.enabled = three.info.autoReset = false;
    if (!(background instanceof THREE.Color)) /** @type {any} */ (scene).background = null;
    try {
      three.setRenderTarget(this.#target);
      three.clear();
      three.render(scene, camera);
    } finally {
      three.setRenderTarget(target, face, level);
      // Of several views in one target each has a part.
      three.state.viewport(viewport);
      /** @type {any} */ (scene).background = background;
      three.shadowMap.autoUpdate = shadows;
      three.xr.enabled = present;
      three.info.autoReset = resets;
      for (const each of hidden) each.visible = true;
    }
    const texture = /** @type {THREE.DepthTexture} */ (this.#target.depthTexture);
    this.depth = /** @type {any} */ (three.properties.get(texture)).__webglTexture;
  }
}

/** @param {THREE.WebGLRenderer} three */
function made(three) {
  const wide = ["EXT_color_buffer_float", "EXT_color_buffer_half_float"].some((value) => three.extensions.has(value));
  const depthTexture = new THREE.DepthTexture(1, 1, THREE.FloatType);
  const type = wide ? THREE.HalfFloatType : THREE.UnsignedByteType;
  return new THREE.WebGLRenderTarget(1, 1, {
    type,
    depthTexture,
    minFilter: THREE.NearestFilter,
    magFilter: THREE.NearestFilter,
  });
}

/** @param {THREE.Object3D} scene */
function materials(scene) {
  /** @type {Set<THREE.Material>} */
  const found = new Set();
  scene.traverseVisible((object) => materialsOf(object).forEach((one) => found.add(one)));
  return [...found];
}

/**
 * Numbers that change with the place or the shape of opaque objects, and the count of these objects. The numbers are
 * null if a shader or a skeleton moves an object.
 * @param {THREE.Object3D} scene @param {THREE.Camera} camera
 */
function contents(scene, camera) {
  /** @type {number[] | null} */
  let numbers = [];
  let count = 0;
  scene.traverseVisible((/** @type {any} */ each) => {
    const opaque = materialsOf(each).filter((one) => one.visible && !one.transparent);
    if (!opaque.length || !each.layers.test(camera.layers)) return;
    count++;
    if ([each, ...opaque].some((one) => LIVELY.some((sort) => /** @type {any} */ (one)[sort]))) numbers = null;
    numbers?.push(each.id, ...each.matrixWorld.elements, ...shapeOf(each), ...opaque.flatMap(kindOf));
  });
  return { numbers: /** @type {number[] | null} */ (numbers), count };
}

/** @param {any} object @returns {number[]} */
function shapeOf({ geometry, instanceMatrix, count = 0, morphTargetInfluences = [] }) {
  if (!geometry) return [];
  const { position } = geometry.attributes;
  const { start, count: range } = geometry.drawRange;
  const versions = [geometry.id, position?.id ?? 0, position?.version ?? 0, geometry.index?.version ?? 0, start];
  return [...versions, range === Infinity ? -1 : range, count, instanceMatrix?.version ?? 0, ...morphTargetInfluences];
}

/** @param {any} material @returns {number[]} */
function kindOf({
  id,
  version,
  side,
  alphaTest,
  depthWrite,
  colorWrite,
  wireframe,
  displacementScale = 0,
  clippingPlanes,
}) {
  const planes = (clippingPlanes ?? []).flatMap((/** @type {THREE.Plane} */ { normal, constant }) => [
    ...normal.toArray(),
    constant,
  ]);
  const flags = [depthWrite, colorWrite, wireframe].map(Number);
  return [id, version, side, alphaTest, displacementScale, ...flags, ...planes];
}
