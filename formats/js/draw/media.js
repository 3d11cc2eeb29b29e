/** Media of a picture whose channels lie on grids of their own: each can be faded. spec/channels.md. */
import { VolpkgError } from "../core/messages.js";

/** Opacities that an app has set, by transfer function. @type {WeakMap<object, Map<string, number>>} */
const OPACITIES = new WeakMap();

/**
 * Fades a medium. Throws VP7084 for one that no such picture shows, or a number below 0.
 * @param {import("../core/package.js").Package} pack @param {import("../core/changes.js").Changes} changes
 * @param {string} transfer @param {number} opacity factor of its extinction
 */
export function fade({ manifest }, changes, transfer, opacity) {
  const own = manifest.pictures.filter(({ grid, media }) => grid && media.length > 1);
  const isShown = own.some(({ media }) => media.some((each) => each.transfer === transfer));
  if (!isShown || !(opacity >= 0 && Number.isFinite(opacity))) throw new VolpkgError("VP7084", { transfer, opacity });
  const opacities = OPACITIES.get(changes) ?? new Map();
  OPACITIES.set(changes, opacities.set(transfer, opacity));
  changes.faded = (picture) => {
    const media = own.find(({ name }) => name === picture)?.media ?? [];
    return Object.fromEntries(media.map((each, i) => [`opacity_of_medium_${i}`, opacities.get(each.transfer) ?? 1]));
  };
}
