// Manifests with one field changed, each opened and drawn. Says what came of them, and of which it was no code.
import { createRenderer, openPackage } from "/js/volpkg.js";

const NASTY = [
  -1,
  0,
  1,
  3,
  2 ** 31,
  1e300,
  0.5,
  "",
  "x",
  "shaders/raycast.vert",
  null,
  [],
  {},
  true,
  "__proto__",
  "constructor",
];

export async function mutants(url, matrix, count, kind, picture, longest) {
  const text = await (await fetch(`${url}/manifest.json`)).text();
  const real = window.fetch;
  let manifest = text;
  window.fetch = (at, how) =>
    String(at).endsWith("manifest.json") ? Promise.resolve(new Response(manifest)) : real(at, how);
  let state = 7;
  const random = (below) => (state = (Math.imul(state, 1103515245) + 12345) >>> 1) % below;
  const leaves = [];
  const walk = (value) => {
    for (const key of Object.keys(value)) {
      leaves.push([value, key]);
      if (typeof value[key] === "object" && value[key] !== null) walk(value[key]);
    }
  };
  const gl = new OffscreenCanvas(8, 8).getContext(kind);
  const found = {};
  const wrong = [];
  for (let i = 0; i < count; i++) {
    const record = JSON.parse(text);
    for (const key of ["plan", "compression", "files", "preview"]) if (key !== "files" || i % 5) delete record[key];
    if (i % 5) record.files = JSON.parse(text).files;
    leaves.length = 0;
    walk(record);
    const [object, key] = leaves[random(leaves.length)];
    const value = NASTY[random(NASTY.length)];
    const before = JSON.stringify(object[key])?.slice(0, 60);
    if (random(4)) object[key] = value;
    else delete object[key];
    manifest = JSON.stringify(record);
    const start = performance.now();
    let what;
    try {
      const pack = await openPackage(url);
      const renderer = await createRenderer(gl, pack, { program: picture });
      await renderer.ready;
      renderer.draw({ boxFromClip: matrix });
      renderer.readPixels();
      renderer.dispose();
      what = "drawn";
    } catch (error) {
      what = error.code ?? "";
      if (!String(what).startsWith("VP")) wrong.push(`${key}: ${before} -> ${JSON.stringify(value)}: ${error.stack}`);
    }
    while (gl.getError());
    if (performance.now() - start > longest)
      wrong.push(`${key}: ${before} -> ${JSON.stringify(value)} takes ${performance.now() - start} ms`);
    found[what] = (found[what] ?? 0) + 1;
  }
  window.fetch = real;
  return { found, wrong };
}
