// Unpacks Zstandard frames in pieces. Reads lines of "size, base64 of frames", and says of each what it holds, or what is wrong.
import { createHash } from "node:crypto";
import { createInterface } from "node:readline";
import { Frames } from "../../formats/js/net/zstd.js";

let seed = 1;
for await (const line of createInterface({ input: process.stdin })) {
  const [size, text] = line.split(" ");
  const bytes = new Uint8Array(Buffer.from(text, "base64"));
  const hash = createHash("sha256");
  const start = performance.now();
  let said;
  try {
    const frames = new Frames(Number(size), (part) => hash.update(part), "t");
    for (let at = 0; at < bytes.length; ) {
      // Pieces of one byte, of a few, and of many.
      seed = (Math.imul(seed, 1103515245) + 12345) >>> 1;
      const piece = bytes.slice(at, at + 1 + (seed % [1, 7, 5000, 100000][(seed >> 8) % 4]));
      frames.take(piece);
      at += piece.length;
    }
    frames.finish();
    said = hash.digest("hex");
  } catch (error) {
    said = error.code ?? error.stack.replaceAll("\n", " ");
  }
  console.log(JSON.stringify([said, performance.now() - start]));
}
