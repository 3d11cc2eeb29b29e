/** Frames of a time series: shown, asked for ahead, and kept on the GPU as long as there is room. */
import { filesOf } from "./progressive.js";

/** @typedef {import("./types.js").Manifest} Manifest */

/**
 * Draws a frame. The picture stays until its textures are there; the files of the next frame are then asked for.
 * @param {import("./renderer_state.js").RendererState} state @param {number | {seconds: number}} wanted
 * @param {import("./options.js").RendererOptions} options
 */
export async function show(state, wanted, { frameBytes = 120e6 }) {
  const { _levels: levels, _changes: changes, package: pack } = /** @type {any} */ (state);
  const { picture, level } = levels.want;
  const { frames = [] } = pack.manifest;
  const frame = typeof wanted === "number" ? wanted : frameAt(frames, wanted.seconds);
  levels.require(picture, level, frame);
  levels.want = { ...levels.want, frame };
  if (levels.device) levels.device.textures.spare = frameBytes;
  changes.version++;
  await levels.refresh();
  if (frames.length) pack.expect(filesOf(pack, picture, level, (frame + 1) % frames.length), pack.signal);
}

/**
 * The frame that is seen at a time: the last one that was taken before it, or the first one.
 * @param {NonNullable<Manifest["frames"]>} frames @param {number} seconds
 */
function frameAt(frames, seconds) {
  const later = frames.findIndex(({ time_s: time = Infinity }) => time > seconds);
  return Math.max((later < 0 ? frames.length : later) - 1, 0);
}
