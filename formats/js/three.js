/** A volume package as an object of three.js. */
import * as THREE from "three";
import { middle, worldFromBox } from "./camera.js";
import { Picker } from "./draw/pick.js";
import { backdropOf, freeBackdrops } from "./three/three_backdrop.js";
import { seenBy, sightOf } from "./three/three_camera.js";
import { drawMixed, isMixable } from "./three/three_layers.js";
import { FRAGMENT, MODES, VERTEX } from "./three/three_shader.js";
import { pageColour } from "./three/three_page.js";
import { Package, VolpkgError, createRenderer, openPackage } from "./volpkg.js";

/** @typedef {import("./core/renderer.js").RendererOptions} RendererOptions */
/** @typedef {import("./core/renderer.js").Renderer} Renderer */
/** @typedef {import("./core/types.js").Grid} Grid */
/** @typedef {THREE.Object3DEventMap & {change: {}}} VolumeEvents */
/** State shared by clones. @typedef {{renderer: Renderer | null, picker: Picker | null, users: number}} Shared */
/**
 * A cached picture, and its state.
 * @typedef {object} View
 * @property {number[]} state numbers that determine the picture
 * @property {number} movedAt when they changed last
 * @property {boolean} coarse
 */

/** Without motion for so long, a picture is drawn in full. */
const REST_MS = 160;
/** Pictures that a volume keeps: of two eyes and some more cameras. */
const MOST_VIEWS = 8;
const OPACITY = 0.5;
/** Volumes side by side may share rounding. */
const LEAST_OVERLAP_MM = 1e-3;
/** Volumes of each renderer: those that overlap say so. @type {WeakMap<THREE.WebGLRenderer, Set<Volume>>} */
const VOLUMES = new WeakMap();

/**
 * Draws a package in a scene, correctly occluded by opaque objects. Its space has the patient's axes (x to the left, y
 * to the back, z to the head), in millimetres, and the middle of the volume at 0; it is turned so that z is up in the
 * scene and the face looks towards its z. Get one from `loadVolume`.
 *
 * Light is mixed as light, in the canvas too. A picture is drawn when something has changed, coarser while the camera
 * moves. The event "change" says that another frame would look different: a finer level has come, or motion has ended.
 * @extends {THREE.Mesh<THREE.BufferGeometry, THREE.Material, VolumeEvents>}
 */
export class Volume extends THREE.Mesh {
  #three;
  #grid;
  #shared;
  #picture = new THREE.ExternalTexture();
  #shown = new THREE.ExternalTexture();
  /** @type {Map<THREE.Camera, View>} */
  #views = new Map();
  #shownSize = "";
  #side;
  /** Frame in which a camera's picture was drawn together with others. @type {WeakMap<THREE.Camera, number>} */
  #drawnIn = new WeakMap();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #rest;
  /** Forgets what a lost context took along: three.js and the renderer restore only their own objects. */
  #lost = () => {
    this.#shown.sourceTexture = null;
    this.#shownSize = "";
    freeBackdrops(this.#three);
  };
  /** Unsupported settings of the scene or the device, each once. @type {string[]} */
  notes = [];

  /** @param {THREE.WebGLRenderer} three @param {Grid} grid @param {Shared} [shared] */
  constructor(three, grid, shared = { renderer: null, picker: null, users: 0 }) {
    const [z, y, x] = grid.extent_mm_zyx;
    const { centre, diagonal } = middle(grid);
    const fromBox = fromBoxOf(grid, centre);
    // The far faces of the box, each pixel once, also where the camera is inside.
    const geometry = new THREE.BoxGeometry(x, y, z).translate(x / 2, y / 2, z / 2).applyMatrix4(fromBox);
    const side = fromBox.determinant() > 0 ? THREE.BackSide : THREE.FrontSide;
    super(geometry, materialOf(side));
    this.#side = side;
    const { uniforms } = this.#material;
    uniforms.picture.value = this.#picture;
    uniforms.shown.value = this.#shown;
    this.#three = three;
    this.#grid = grid;
    this.#shared = shared;
    shared.users++;
    /** Half of the volume's diagonal, in millimetres. */
    this.radius = diagonal / 2;
    // The head up and the face to the viewer, as three.js has its axes.
    this.rotation.x = -Math.PI / 2;
    /** @param {THREE.WebGLRenderer} by @param {THREE.Object3D} scene @param {THREE.Camera} camera */
    this.onBeforeRender = (by, scene, camera) => this.#before(by, scene, camera);
    three.domElement.addEventListener("webglcontextlost", this.#lost);
    VOLUMES.set(three, (VOLUMES.get(three) ?? new Set()).add(this));
  }

  /** Grid of the picture that is drawn: that of one channel may differ from the one that the object was made for. */
  get #drawnGrid() {
    return this.#shared.renderer?.grid ?? this.#grid;
  }

  /** From box millimetres of that picture to the object's own space. */
  get #fromBox() {
    return fromBoxOf(this.#drawnGrid, middle(this.#grid).centre);
  }

  get #material() {
    return /** @type {THREE.ShaderMaterial} */ (this.material);
  }

  /** Everything that can be changed: levels, transfer functions, clipping, step. */
  get renderer() {
    return /** @type {Renderer} */ (this.#shared.renderer);
  }

  /** Begins to draw. @param {import("./core/package.js").Package} pack @param {RendererOptions} options */
  async start(pack, options) {
    const three = this.#three;
    const around = (/** @type {() => void} */ work) => this.#around(work);
    const renderer = await createRenderer(three.getContext(), pack, { ...options, depth: true, around }).catch(
      (error) => {
        this.dispose();
        throw error;
      },
    );
    this.#shared.renderer = renderer;
    const picker = (this.#shared.picker = new Picker(renderer));
    renderer.onchange = () => {
      this.#changed();
      // Another program has another way to read values.
      picker.prepare().catch(() => {});
    };
    await picker.prepare();
    return this;
  }

  /**
   * Another object that draws the same package: GPU resources, level, function and clip are shared.
   * @param {boolean} [recursive]
   * @returns {this}
   */
  clone(recursive) {
    return /** @type {this} */ (new Volume(this.#three, this.#grid, this.#shared).copy(this, recursive));
  }

  /** @param {any} source @param {boolean} [recursive] */
  copy(source, recursive) {
    const { geometry, material } = this;
    super.copy(source, recursive);
    Object.assign(this, { geometry, material });
    const { opacity, clippingPlanes, toneMapped, visible } = source.material;
    Object.assign(this.#material, { opacity, clippingPlanes, toneMapped, visible });
    return this;
  }

  /** Frees everything on the GPU that no clone needs. */
  dispose() {
    const { renderer } = this.#shared;
    clearTimeout(this.#rest);
    VOLUMES.get(this.#three)?.delete(this);
    this.#three.domElement.removeEventListener("webglcontextlost", this.#lost);
    for (const view of this.#views.values()) renderer?.forget(view);
    this.#views.clear();
    if (this.#shown.sourceTexture)
      this.#three.getContext().deleteTexture(/** @type {WebGLTexture} */ (this.#shown.sourceTexture));
    this.#shown.sourceTexture = null;
    this.#shownSize = "";
    this.geometry.dispose();
    this.#material.dispose();
    if (--this.#shared.users) return;
    renderer?.dispose();
    freeBackdrops(this.#three);
  }

  /**
   * Finds the first point of a ray where the accumulated opacity reaches `raycaster.params.Volume.opacity` (0.5 if
   * absent): the point that a viewer sees. The intersection also has the fields of a `Hit`; its normal is in the space
   * of the object.
   * @param {THREE.Raycaster} raycaster @param {THREE.Intersection[]} intersects
   */
  raycast(raycaster, intersects) {
    const { picker } = this.#shared;
    const { ray, near, far } = raycaster;
    if (!picker || !this.renderer.inside) return;
    const boxFromWorld = this.matrixWorld.clone().multiply(this.#fromBox).invert();
    const centre = new THREE.Vector3().setFromMatrixPosition(this.matrixWorld);
    const reach = ray.origin.distanceTo(centre) + this.radius * this.matrixWorld.getMaxScaleOnAxis();
    const at = (/** @type {number} */ t) => ray.at(t, new THREE.Vector3()).applyMatrix4(boxFromWorld).toArray();
    const opacity = /** @type {any} */ (raycaster.params).Volume?.opacity ?? OPACITY;
    const hit = far > near && picker.pick(at(near), at(Math.min(far, reach)), { opacity });
    if (!hit) return;
    const point = new THREE.Vector3().fromArray(hit.box_mm).applyMatrix4(this.#fromBox).applyMatrix4(this.matrixWorld);
    const distance = ray.origin.distanceTo(point);
    const normal = hit.normal ? new THREE.Vector3().fromArray(hit.normal) : undefined;
    intersects.push(/** @type {any} */ ({ ...hit, distance, point, normal, object: this }));
  }

  #changed() {
    /** @type {any} */ (this).dispatchEvent({ type: "change" });
  }

  /** @param {string} note */
  #note(note) {
    if (this.notes.includes(note)) return;
    this.notes.push(note);
    console.warn(`volpkg: ${note}`);
  }

  /** Uses the context between calls of three.js. @param {() => void} work */
  #around(work) {
    const three = this.#three;
    const target = three.getRenderTarget();
    const [face, level] = [three.getActiveCubeFace(), three.getActiveMipmapLevel()];
    const { depth } = three.state.buffers;
    const reversed = depth.getReversed();
    depth.setReversed(false);
    work();
    // three.js caches the context's state.
    three.resetState();
    three.setRenderTarget(target, face, level);
    depth.setReversed(reversed);
    depth.setClear(1);
  }

  /** @param {THREE.WebGLRenderer} by @param {THREE.Object3D} scene @param {THREE.Camera} camera */
  #before(by, scene, camera) {
    const three = this.#three;
    const { uniforms } = this.#material;
    uniforms.mode.value = MODES.nothing;
    this.#material.uniformsNeedUpdate = true;
    if (by !== three)
      return this.#note("a volume is drawn by the WebGLRenderer that it was loaded for, and by no other");
    // Passes for normals, depth or outlines have materials of their own.
    if (/** @type {any} */ (scene).overrideMaterial || !this.#shared.renderer) return;
    const part = /** @type {any} */ (camera).viewport;
    const viewport = part instanceof THREE.Vector4 ? part.clone() : three.getCurrentViewport(new THREE.Vector4());
    if (!(viewport.z >= 1 && viewport.w >= 1)) return;
    const reversed = three.state.buffers.depth.getReversed();
    const { logarithmicDepthBuffer: logarithmic } = three.capabilities;
    const depth = { reversed, logarithmic };
    const group = this.#group(scene, camera, depth);
    if (!group.length) return;
    const backdrop = backdropOf(three, scene, camera, viewport);
    const view = this.#view(camera);
    if (
      this.#draw(
        view,
        viewport,
        group.map((each) => each.#body(camera, depth)),
        backdrop,
      )
    ) {
      three.state.viewport(viewport);
      this.#picture.sourceTexture = this.renderer.textureOf(view);
      uniforms.whole.value = group.length > 1;
      this.#material.side = group.length > 1 ? THREE.DoubleSide : this.#side;
      if (this.#picture.sourceTexture) this.#show(viewport, backdrop, scene, camera);
    }
  }

  /**
   * The volumes that are drawn with this one, because they overlap; alone if they cannot be mixed; none if another one
   * has drawn this one in this frame.
   * @param {THREE.Object3D} scene @param {THREE.Camera} camera @param {{reversed: boolean, logarithmic: boolean}} depth
   * @returns {Volume[]}
   */
  #group(scene, camera, depth) {
    /** @type {Volume[]} */
    const group = [this];
    // A `renderOrder` of its own asks for an order.
    const others = [...(VOLUMES.get(this.#three) ?? [])].filter(
      (each) => each !== this && each.renderOrder === this.renderOrder && each.#isIn(scene, camera),
    );
    for (const each of group)
      group.push(...others.filter((one) => !group.includes(one) && each.#reaches(one) && one.#reaches(each)));
    if (group.length === 1) return group;
    const mixes = group.every(
      (each) => isMixable(each.renderer) && each.#material.opacity === 1 && !each.#body(camera, depth).seen.oblique,
    );
    this.#note(
      mixes
        ? "volumes that overlap are mixed in layers of depth, 32 at rest"
        : "volumes that overlap are drawn whole, the one with the farther middle first, and not mixed: a program of " +
            "several draws, an opacity of the object, or a mirror",
    );
    if (!mixes) return [this];
    const { frame } = this.#three.info.render;
    const isFirst = group.every((each) => each.#drawnIn.get(camera) !== frame);
    if (isFirst) this.#drawnIn.set(camera, frame);
    return isFirst ? group : [];
  }

  /** Whether it is drawn with a scene. @param {THREE.Object3D} scene @param {THREE.Camera} camera */
  #isIn(scene, camera) {
    /** @type {THREE.Object3D} */
    let root = this;
    while (root.visible && root.parent) root = root.parent;
    return root === scene && root.visible && this.layers.test(camera.layers) && Boolean(this.#shared.renderer?.inside);
  }

  /** @param {THREE.Camera} camera @param {{reversed: boolean, logarithmic: boolean}} depth */
  #body(camera, depth) {
    const worldFromBox = this.matrixWorld.clone().multiply(this.#fromBox);
    const seen = seenBy(camera, worldFromBox, [...this.#drawnGrid.extent_mm_zyx].reverse(), depth);
    return { renderer: this.renderer, seen, planes: this.#planes(worldFromBox) };
  }

  /** Whether the box of another volume reaches into this one, along the axes of this one. @param {Volume} other */
  #reaches(other) {
    const [mine, theirs] = [this, other].map((each) => each.matrixWorld.clone().multiply(each.#fromBox));
    const [box, whole] = [other, this].map((each) => {
      const [z, y, x] = each.#drawnGrid.extent_mm_zyx;
      return new THREE.Box3(new THREE.Vector3(), new THREE.Vector3(x, y, z));
    });
    const shared = box.applyMatrix4(mine.invert().multiply(theirs)).intersect(whole).getSize(new THREE.Vector3());
    return Math.min(shared.x, shared.y, shared.z) > LEAST_OVERLAP_MM;
  }

  /** The picture that is kept for a camera. @param {THREE.Camera} camera */
  #view(camera) {
    const found = this.#views.get(camera) ?? { state: [], movedAt: 0, coarse: false };
    this.#views.delete(camera);
    this.#views.set(camera, found);
    for (const [each, old] of this.#views) {
      if (this.#views.size <= MOST_VIEWS) break;
      this.renderer.forget(old);
      this.#views.delete(each);
    }
    return found;
  }

  /**
   * Draws the picture of a view, if it shows something else than is there: coarser while that changes. False where
   * there is nothing between the planes of the camera.
   * @param {View} view @param {THREE.Vector4} viewport @param {import("./three/three_layers.js").Body[]} bodies
   * @param {ReturnType<typeof backdropOf>} backdrop
   */
  #draw(view, viewport, bodies, { depth: texture, version }) {
    const { renderer } = this;
    const sights = bodies.map(({ seen }) => sightOf(seen));
    const [sight] = sights;
    if (!sights.some(Boolean)) return false;
    const state = [viewport.z, viewport.w, version, bodies.length];
    bodies.forEach(({ planes }, i) =>
      state.push(...(sights[i]?.boxFromClip.elements ?? []), planes.length, ...planes.flat()),
    );
    const differs = (/** @type {number[]} */ one) => one.some((each, i) => each !== view.state[i]);
    const isFirst = !view.state.length || !renderer.textureOf(view);
    const now = performance.now();
    if (!isFirst && differs(state)) view.movedAt = now;
    const moving = now - view.movedAt < REST_MS;
    const all = [...state, ...bodies.map((body) => body.renderer.revision)];
    if (!isFirst && !differs(all) && !(view.coarse && !moving)) return true;
    view.state = all;
    const depth = texture ? { texture, reversed: bodies[0].seen.reversed } : undefined;
    if (bodies.length > 1) {
      drawMixed(renderer, view, bodies, [viewport.z, viewport.w], depth, moving);
      view.coarse = moving;
    } else if (sight) {
      renderer.draw({
        boxFromClip: sight.boxFromClip.elements,
        viewport: [0, 0, viewport.z, viewport.w],
        depth: depth && { ...depth, scale: sight.scale },
        planes: bodies[0].planes,
        keep: view,
        moving,
      });
      const { step, scale: pixels } = renderer.inside?.last?.quality ?? { step: 1, scale: 1 };
      view.coarse = step !== 1 || pixels !== 1;
    }
    clearTimeout(this.#rest);
    if (moving) this.#rest = setTimeout(() => this.#changed(), REST_MS + 1);
    return true;
  }

  /**
   * Sets the shader's inputs for blending.
   * @param {THREE.Vector4} viewport @param {ReturnType<typeof backdropOf>} backdrop
   * @param {THREE.Object3D} scene @param {THREE.Camera} camera
   */
  #show(viewport, backdrop, scene, camera) {
    const three = this.#three;
    const { uniforms, opacity } = this.#material;
    const target = /** @type {any} */ (three.getRenderTarget());
    const mode = target === null ? MODES.canvas : target.isXRRenderTarget ? MODES.headset : MODES.linear;
    uniforms.mode.value = mode;
    uniforms.place.value.set(viewport.x, viewport.y, 1 / viewport.z, 1 / viewport.w);
    uniforms.opacity.value = opacity;
    this.#fog(/** @type {any} */ (scene).fog, camera);
    // The shader blends itself; its output replaces the pixel.
    this.#material.blending = mode === MODES.canvas ? THREE.NoBlending : THREE.CustomBlending;
    uniforms.light.value = backdrop.depth ? backdrop.light : null;
    uniforms.lit.value = backdrop.depth !== null;
    if (mode !== MODES.canvas) return;
    uniforms.encoded.value = THREE.ColorManagement.getTransfer(three.outputColorSpace) === THREE.SRGBTransfer;
    const { colour, note } = pageColour(three.getContext());
    uniforms.page.value.fromArray(colour);
    if (note) this.#note(note);
    this.#copy(viewport);
  }

  /** Copies the canvas's picture so far. @param {THREE.Vector4} viewport */
  #copy({ x, y, z, w }) {
    const { state } = this.#three;
    const gl = this.#three.getContext();
    const format = gl.getContextAttributes()?.alpha === false ? gl.RGB : gl.RGBA;
    const isNew = !this.#shown.sourceTexture || this.#shownSize !== `${z} ${w}`;
    this.#shown.sourceTexture ??= gl.createTexture();
    state.bindTexture(gl.TEXTURE_2D, /** @type {any} */ (this.#shown.sourceTexture));
    if (isNew) {
      gl.copyTexImage2D(gl.TEXTURE_2D, 0, format, x, y, z, w, 0);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
      this.#shownSize = `${z} ${w}`;
    } else gl.copyTexSubImage2D(gl.TEXTURE_2D, 0, 0, 0, x, y, z, w);
    state.unbindTexture();
  }

  /** Fog as at the middle of the volume. @param {any} fog @param {THREE.Camera} camera */
  #fog(fog, camera) {
    const { value } = this.#material.uniforms.fog;
    value.set(0, 0, 0, 0);
    if (!fog) return;
    const centre = new THREE.Vector3().setFromMatrixPosition(this.matrixWorld);
    const distance = -centre.applyMatrix4(camera.matrixWorldInverse).z;
    const linear = THREE.MathUtils.smoothstep(distance, fog.near, fog.far);
    const { r, g, b } = fog.color;
    value.set(r, g, b, fog.isFogExp2 ? 1 - Math.exp(-((fog.density * distance) ** 2)) : linear);
  }

  /** Planes of three.js in box millimetres. @param {THREE.Matrix4} worldFromBox @returns {number[][]} */
  #planes(worldFromBox) {
    const { clippingPlanes, clipIntersection } = this.#material;
    const local = (this.#three.localClippingEnabled && clippingPlanes) || [];
    if (clipIntersection && local.length > 1)
      this.#note("clipIntersection is not supported: each plane cuts the volume");
    const transposed = worldFromBox.clone().transpose();
    return [...this.#three.clippingPlanes, ...local].map(({ normal, constant }) => {
      return new THREE.Vector4(normal.x, normal.y, normal.z, constant).applyMatrix4(transposed).toArray();
    });
  }
}

/** @param {THREE.Side} side */
function materialOf(side) {
  return new THREE.ShaderMaterial({
    uniforms: {
      picture: { value: null },
      shown: { value: null },
      light: { value: null },
      place: { value: new THREE.Vector4() },
      opacity: { value: 1 },
      mode: { value: MODES.nothing },
      encoded: { value: true },
      lit: { value: false },
      page: { value: new THREE.Vector3() },
      fog: { value: new THREE.Vector4() },
      whole: { value: false },
    },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    side,
    transparent: true,
    depthTest: false,
    depthWrite: false,
    blending: THREE.CustomBlending,
    blendSrc: THREE.OneFactor,
    blendDst: THREE.OneMinusSrcAlphaFactor,
  });
}

/** From box millimetres to an object's own space, whose origin is `centre`. @param {Grid} grid @param {number[]} centre */
function fromBoxOf(grid, [x, y, z]) {
  const toCentre = new THREE.Matrix4().makeTranslation(-x, -y, -z);
  return toCentre.multiply(new THREE.Matrix4().fromArray(worldFromBox(grid)));
}

/**
 * A package as an object that can be added to a scene. Its coarsest level is there when the promise is fulfilled.
 * @param {THREE.WebGLRenderer} renderer
 * @param {Parameters<typeof openPackage>[0] | Package} from as `openPackage` takes it, or an open package
 * @param {RendererOptions & Parameters<typeof openPackage>[1]} [options]
 * @returns {Promise<Volume>}
 */
export async function loadVolume(renderer, from, options = {}) {
  // WebGPURenderer has no context that a package can be drawn in.
  if (!(/** @type {any} */ (renderer)?.isWebGLRenderer))
    throw new VolpkgError("VP7018", { problem: "loadVolume needs a THREE.WebGLRenderer" });
  const pack = from instanceof Package ? from : await openPackage(from, options);
  const { pictures, grid } = pack.manifest;
  return new Volume(renderer, pictures[0]?.grid ?? grid).start(pack, options);
}
