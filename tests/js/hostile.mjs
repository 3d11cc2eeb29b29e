// Opens damaged packages in node and reads everything in them. Says for each what came of it.
import { readFile } from "node:fs/promises";
import { openPackage } from "../../formats/js/volpkg.js";
import { partsOf } from "../../formats/js/gl/mesh.js";
import { HEAD_BYTES, readHead } from "../../formats/js/gl/ktx2.js";
import { sharing } from "../../formats/js/core/drawing.js";
import { shares } from "../../formats/js/edit/edit.js";

const [file, seed, count] = process.argv.slice(2);
const whole = await readFile(file);
let state = Number(seed);
/** Numbers that are the same each time (mulberry32). */
function random(below) {
  state = (state + 0x6d2b79f5) | 0;
  let t = Math.imul(state ^ (state >>> 15), 1 | state);
  t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
  return ((t ^ (t >>> 14)) >>> 0) % below;
}

/** Everything that is in a package. */
async function readAll(bytes) {
  const pack = await openPackage(bytes);
  const { manifest } = pack;
  for (const { path } of manifest.files) await pack.read(path);
  for (const texture of manifest.textures)
    readHead(
      (await pack.read(texture.file)).subarray(0, HEAD_BYTES),
      pack.size(texture.file),
      sharing(manifest, texture),
    );
  for (const each of manifest.proxy?.meshes ?? [])
    if (each.file) await partsOf(await pack.read(each.file), each.file, each.triangles);
  for (const each of manifest.editing?.histograms ?? []) shares(await pack.read(each.file), each.file);
  return "whole";
}

const found = {};
let longest = 0;
async function tell(bytes) {
  const start = performance.now();
  const what = await readAll(bytes).catch((error) => error.code ?? `${error.stack}`);
  longest = Math.max(longest, performance.now() - start);
  found[what] = (found[what] ?? 0) + 1;
}

const copy = () => new Uint8Array(whole).buffer;
await tell(copy());
for (let i = 0; i < Number(count); i++) {
  // The ends hold the directory and the manifest; most damage goes there.
  const bytes = new Uint8Array(copy());
  const at = random(3)
    ? random(2)
      ? bytes.length - 1 - random(Math.min(6000, bytes.length))
      : random(9000)
    : random(bytes.length);
  if (i % 4 === 0) {
    await tell(bytes.buffer.slice(0, at));
    continue;
  }
  for (let k = 0; k <= i % 3; k++)
    bytes[Math.min(at + random(8), bytes.length - 1)] = [0, 255, random(256), random(256)][random(4)];
  await tell(bytes.buffer);
}
console.log(JSON.stringify({ found, longest }));
