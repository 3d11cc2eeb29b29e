/** A volume package as an object of three.js. */
import * as THREE from "three";
import { middle, worldFromBox } from "./camera.js";
import { createRenderer, openPackage } from "./volpkg.js";

/** @typedef {import("./renderer.js").RendererOptions} RendererOptions */
/** @typedef {import("./renderer.js").Renderer} Renderer */

const VERTEX = `void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;
/** The picture is linear and premultiplied; three.js says which tone mapping and which colour space it goes into. */
const FRAGMENT = `uniform sampler2D picture;
uniform vec4 place;
void main() {
  gl_FragColor = texture2D(picture, (gl_FragCoord.xy - place.xy) * place.zw);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
}
`;

/** Depth as three.js has it where the near plane is at 1, in place of OpenGL's. */
const REVERSED = new THREE.Matrix4().set(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -0.5, 0.5, 0, 0, 0, 1);

/**
 * Draws a package in a scene, behind and in front of what is opaque. Its space has the patient's axes (x to the left, y to
 * the back, z to the head), in millimetres, and the middle of the volume at 0; it is turned so that z is up in the scene and
 * the face looks towards its z. Get one from `loadVolume`.
 *
 * Into a render target the picture is blended linearly, as SPEC.md says; into the canvas, where three.js writes encoded
 * colours, what is half transparent is blended as everything else is there.
 */
export class Volume extends THREE.Mesh {
  #three;
  /** @type {Renderer | null} */
  #renderer = null;
  #fromBox;
  #picture = new THREE.ExternalTexture();
  #depth = new THREE.WebGLRenderTarget(1, 1, { depthTexture: new THREE.DepthTexture(1, 1) });

  /** @param {THREE.WebGLRenderer} three @param {import("./types.js").Grid} grid */
  constructor(three, grid) {
    const [z, y, x] = grid.extent_mm_zyx;
    const { centre, diagonal } = middle(grid);
    const fromBox = new THREE.Matrix4().makeTranslation(-centre[0], -centre[1], -centre[2]).multiply(new THREE.Matrix4().fromArray(worldFromBox(grid)));
    // The far faces of the box, each pixel once, also where the camera is inside.
    const geometry = new THREE.BoxGeometry(x, y, z).translate(x / 2, y / 2, z / 2).applyMatrix4(fromBox);
    const picture = { value: /** @type {THREE.Texture | null} */ (null) };
    super(
      geometry,
      new THREE.ShaderMaterial({
        uniforms: { picture, place: { value: new THREE.Vector4() } },
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        side: fromBox.determinant() > 0 ? THREE.BackSide : THREE.FrontSide,
        transparent: true,
        depthTest: false,
        depthWrite: false,
        blending: THREE.CustomBlending,
        blendSrc: THREE.OneFactor,
        blendDst: THREE.OneMinusSrcAlphaFactor,
      }),
    );
    picture.value = this.#picture;
    this.#three = three;
    this.#fromBox = fromBox;
    /** Half of the volume's diagonal, in millimetres. */
    this.radius = diagonal / 2;
    // The head up and the face to the viewer, as three.js has its axes.
    this.rotation.x = -Math.PI / 2;
    /** @param {THREE.WebGLRenderer} _ @param {THREE.Object3D} scene @param {THREE.Camera} camera */
    this.onBeforeRender = (_, scene, camera) => this.#draw(scene, camera);
  }

  /** Everything that can be changed: levels, transfer functions, clipping, step. */
  get renderer() {
    return /** @type {Renderer} */ (this.#renderer);
  }

  /** Begins to draw. @param {import("./package.js").Package} pack @param {RendererOptions} options */
  async start(pack, options) {
    const three = this.#three;
    const around = (/** @type {() => void} */ work) => {
      const target = three.getRenderTarget();
      const [face, level] = [three.getActiveCubeFace(), three.getActiveMipmapLevel()];
      work();
      // three.js keeps what it believes the context's state to be.
      three.resetState();
      three.setRenderTarget(target, face, level);
    };
    this.#renderer = await createRenderer(three.getContext(), pack, { ...options, around });
    await this.#renderer.setClip({ depth: true });
    return this;
  }

  /** Frees everything on the GPU. */
  dispose() {
    this.#renderer?.dispose();
    this.#depth.dispose();
    this.geometry.dispose();
    /** @type {THREE.Material} */ (this.material).dispose();
  }

  /** @param {THREE.Object3D} scene @param {THREE.Camera} camera */
  #draw(scene, camera) {
    const three = this.#three;
    const viewport = three.getCurrentViewport(new THREE.Vector4());
    const reversed = /** @type {any} */ (camera).reversedDepth === true;
    const clipFromBox = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).multiply(this.matrixWorld).multiply(this.#fromBox);
    const boxFromClip = clipFromBox.invert();
    if (reversed) boxFromClip.multiply(REVERSED);
    const texture = this.#opaque(scene, camera, viewport);
    this.renderer.draw({ boxFromClip: boxFromClip.elements, viewport: [0, 0, viewport.z, viewport.w], depth: { texture, reversed } });
    this.#picture.sourceTexture = this.renderer.texture;
    const { place } = /** @type {THREE.ShaderMaterial} */ (this.material).uniforms;
    place.value.set(viewport.x, viewport.y, 1 / viewport.z, 1 / viewport.w);
    /** @type {THREE.ShaderMaterial} */ (this.material).uniformsNeedUpdate = true;
  }

  /**
   * Depth of what is opaque, drawn once more: the canvas's own cannot be read.
   * @param {THREE.Object3D} scene @param {THREE.Camera} camera @param {THREE.Vector4} viewport
   * @returns {WebGLTexture}
   */
  #opaque(scene, camera, viewport) {
    const three = this.#three;
    const hidden = /** @type {THREE.Material[]} */ ([]);
    scene.traverse((each) => {
      for (const material of [/** @type {any} */ (each).material ?? []].flat()) {
        if (!material.visible || !material.transparent) continue;
        material.visible = false;
        hidden.push(material);
      }
    });
    const target = three.getRenderTarget();
    const [face, level] = [three.getActiveCubeFace(), three.getActiveMipmapLevel()];
    const [shadows, present] = [three.shadowMap.autoUpdate, three.xr.enabled];
    const background = /** @type {any} */ (scene).background;
    three.shadowMap.autoUpdate = three.xr.enabled = false;
    /** @type {any} */ (scene).background = null;
    this.#depth.setSize(viewport.z, viewport.w);
    three.setRenderTarget(this.#depth);
    three.clear();
    three.render(scene, camera);
    three.setRenderTarget(target, face, level);
    /** @type {any} */ (scene).background = background;
    three.shadowMap.autoUpdate = shadows;
    three.xr.enabled = present;
    for (const material of hidden) material.visible = true;
    return /** @type {any} */ (three.properties.get(/** @type {THREE.DepthTexture} */ (this.#depth.depthTexture))).__webglTexture;
  }
}

/**
 * A package as an object that can be added to a scene. Its coarsest level is there when the promise is fulfilled.
 * @param {THREE.WebGLRenderer} renderer
 * @param {string | URL | Blob | ArrayBuffer} from as `openPackage` takes it
 * @param {RendererOptions & Parameters<typeof openPackage>[1]} [options]
 * @returns {Promise<Volume>}
 */
export async function loadVolume(renderer, from, options = {}) {
  const pack = await openPackage(from, options);
  return new Volume(renderer, pack.manifest.grid).start(pack, options);
}
