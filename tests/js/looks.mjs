/** Prints the textures that change when segments are hidden. Reads {manifest, folder, level, hidden} as JSON. */
import { readFileSync } from "node:fs";
import { uploadOf } from "../../formats/js/gl/formats.js";
import { Segments } from "../../formats/js/draw/segments.js";

const { manifest, folder, level, hidden } = JSON.parse(readFileSync(0, "utf8"));
for (const each of manifest.textures) each.gl = uploadOf(each.format, each.dimension, manifest.profile.api);
const pack = {
  manifest,
  name: "package",
  read: async (path) => new Uint8Array(readFileSync(`${folder}/${path}`)),
};
const signal = new AbortController().signal;
const textures = manifest.textures.filter(
  (each) => ["looks", "skip"].includes(each.role) && [undefined, level].includes(each.level),
);
const choice = { level: { index: level }, textures, texels: {} };
const segments = new Segments(manifest, "package");
await segments.shown(pack, choice, signal);
for (const name of hidden) segments.set(name, { visible: false });
const { texels } = await segments.shown(pack, choice, signal);
console.log(
  JSON.stringify(Object.fromEntries(Object.entries(texels).map(([k, v]) => [k, Buffer.from(v).toString("hex")]))),
);
