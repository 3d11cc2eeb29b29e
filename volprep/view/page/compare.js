/** Pictures of this device against the truth: 8 bits that were read back, 16 bits from the report. */

/**
 * A truth picture: its planes red, green, blue and opacity, row 0 on top, 65535 for 1.
 * formats/volprep_formats/light_pictures.py says how it is written.
 * @param {Uint8Array<ArrayBuffer>} packed
 * @param {number} size width and height
 */
export async function truthPicture(packed, size) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const pixels = size * size;
  const plain = await exactly(stream, 8 * pixels);
  const planes = new Uint16Array(4 * pixels);
  for (let at = 0; at < planes.length; at++) {
    const step = plain[at] * 256 + plain[planes.length + at];
    planes[at] = at % size ? planes[at - 1] + step : step;
  }
  return planes;
}

/**
 * All bytes of a stream, which must be as many as expected: a damaged file must not fill the memory.
 * @param {ReadableStream<Uint8Array>} stream
 * @param {number} expected
 */
async function exactly(stream, expected) {
  const all = new Uint8Array(expected);
  let at = 0;
  const reader = stream.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    if (at + value.length > expected) {
      await reader.cancel();
      at = -1;
      break;
    }
    all.set(value, at);
    at += value.length;
  }
  if (at !== expected) throw new Error("a truth picture does not have the size that its list says");
  return all;
}

/** Half a step of 8 bits: fainter light rounds to black. */
const LEAST_SEEN = 0.5 / 255;

/**
 * How far a picture is from the truth, premultiplied linear: over all pixels and channels, and over the pixels in which
 * one of the two shows something.
 * @param {Uint8Array | Uint8ClampedArray} pixels RGBA, row 0 on top
 * @param {Uint16Array} planes
 */
export function errorOf(pixels, planes) {
  const count = planes.length / 4;
  let [sum, ofSeen, seen, maximum] = [0, 0, 0, 0];
  for (let pixel = 0; pixel < count; pixel++) {
    let [own, brightest] = [0, 0];
    for (let channel = 0; channel < 4; channel++) {
      const drawn = pixels[4 * pixel + channel] / 255;
      const truth = planes[channel * count + pixel] / 65535;
      const difference = Math.abs(drawn - truth);
      own += difference * difference;
      maximum = Math.max(maximum, difference);
      brightest = Math.max(brightest, drawn, truth);
    }
    sum += own;
    if (brightest <= LEAST_SEEN) continue;
    ofSeen += own;
    seen++;
  }
  return { rmse: Math.sqrt(sum / planes.length), seen_rmse: seen ? Math.sqrt(ofSeen / (4 * seen)) : 0, maximum };
}
