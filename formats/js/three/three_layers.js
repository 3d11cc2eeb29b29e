/** Volumes that overlap: one picture of all, mixed in layers of depth from back to front. */
import { sightOf } from "./three_camera.js";

/** @typedef {import("../core/renderer.js").Renderer} Renderer */
/** @typedef {import("./three_camera.js").Seen} Seen */
/**
 * A volume as a camera sees it.
 * @typedef {{renderer: Renderer, seen: Seen, planes: number[][]}} Body
 */

/** Layers of the depth that two volumes share, at rest and in motion. */
const LAYERS = { rest: 32, moving: 12 };

/** Whether a picture may be laid over another one: drawn at once, and by samples that hide others. @param {Renderer} renderer */
export function isMixable({ inside }) {
  const { technique, choice } = inside?.drawn ?? {};
  return (
    technique == null &&
    ["emission-absorption", "back-to-front"].includes(choice?.program.compositing ?? "emission-absorption")
  );
}

/**
 * Draws volumes into one picture. In a layer one lies over the other, in each the other way round, so that the errors
 * of both orders cancel.
 * @param {Renderer} owner whose picture it becomes @param {object} keep its key @param {Body[]} bodies
 * @param {readonly [number, number]} size @param {{texture: WebGLTexture, reversed: boolean} | undefined} depth
 * @param {boolean} moving
 */
export function drawMixed(owner, keep, bodies, [width, height], depth, moving) {
  const { gl, device } = /** @type {NonNullable<Renderer["inside"]>} */ (owner.inside);
  const picture = device.pictures.of(keep);
  owner.use(() => {
    picture.bind(width, height);
    device.state(false);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
  });
  const layers = layersOf(
    bodies.map(({ seen }) => seen.depths),
    moving ? LAYERS.moving : LAYERS.rest,
  );
  layers.forEach((layer, number) => {
    for (const { renderer, seen, planes } of number % 2 ? [...bodies].reverse() : bodies) {
      const sight = sightOf(seen, layer);
      if (!sight) continue;
      renderer.draw({
        boxFromClip: sight.boxFromClip.elements,
        viewport: [0, 0, width, height],
        target: picture.frame,
        depth: depth && { ...depth, scale: sight.scale },
        planes,
        blend: true,
        moving,
      });
    }
  });
}

/**
 * Ranges of distance, the farthest first. Where only one volume can be there is one layer.
 * @param {(readonly [number, number])[]} depths nearest and farthest distance of each volume @param {number} count
 */
function layersOf(depths, count) {
  const nears = depths.map(([near]) => near).sort((a, b) => a - b);
  const fars = depths.map(([, far]) => far).sort((a, b) => b - a);
  const [from, to] = [nears[1], fars[1]];
  const cuts = Array.from({ length: count + 1 }, (_, i) => to + ((from - to) * i) / count);
  const all = [fars[0], ...cuts, nears[0]];
  return all.slice(1).map((near, i) => /** @type {[number, number]} */ ([near, all[i]]));
}
