/** How often each value occurs in the volume, counted on slices of the level that is drawn. */

const [BINS, SLICES, SIZE] = [128, 24, 128];

/**
 * Heights from 0 to 1, logarithmic, of equal parts of a window of values; null where the shaders read no values, and
 * for bricks on demand.
 * @param {import("../runtime/renderer.js").Renderer} renderer @param {readonly number[]} window
 */
export async function histogram(renderer, [low, high]) {
  // Of bricks on demand it would fetch the whole volume.
  if (renderer.inside?.drawn.choice.bricks) return null;
  const counts = new Array(BINS).fill(0);
  for (let i = 0; i < SLICES; i++) {
    const slice = await renderer.slice?.({ at: (i + 0.5) / SLICES, size: SIZE });
    if (!slice) return null;
    for (const value of slice.values) {
      const bin = Math.floor(((value - low) / (high - low)) * BINS);
      if (bin >= 0) counts[Math.min(bin, BINS - 1)]++;
    }
  }
  const most = Math.log1p(Math.max(1, ...counts));
  return counts.map((count) => Math.log1p(count) / most);
}
