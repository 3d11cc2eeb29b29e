// Reads glTF binary files with three.js, and prints what it found, one JSON object a line. Called by test_three.py:
//   node read_glb.mjs FOLDER_OF_THREE FILE...
// three.js decodes Draco in a web worker, which node has not: its decoder, the same program, is called directly.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const [folder, ...files] = process.argv.slice(2);
const root = `${folder}/node_modules/three`;
const three = await import(pathToFileURL(`${root}/build/three.module.js`));
const { GLTFLoader } = await import(pathToFileURL(`${root}/examples/jsm/loaders/GLTFLoader.js`));
globalThis.self ??= globalThis;
globalThis.ProgressEvent ??= class extends Event {};

const source = readFileSync(`${root}/examples/jsm/libs/draco/gltf/draco_decoder.js`, "utf8");
const module_ = { exports: {} };
new Function("module", "exports", "require", "__dirname", source)(
  module_,
  module_.exports,
  createRequire(import.meta.url),
  root,
);
const draco = await module_.exports();

function decode(data, ids) {
  const decoder = new draco.Decoder();
  const bytes = new draco.DecoderBuffer();
  bytes.Init(new Int8Array(data), data.byteLength);
  const mesh = new draco.Mesh();
  const status = decoder.DecodeBufferToMesh(bytes, mesh);
  if (!status.ok()) throw new Error(status.error_msg());
  const geometry = new three.BufferGeometry();
  const values = new draco.DracoFloat32Array();
  decoder.GetAttributeFloatForAllPoints(mesh, decoder.GetAttributeByUniqueId(mesh, ids.position), values);
  const positions = Float32Array.from({ length: values.size() }, (_, k) => values.GetValue(k));
  const face = new draco.DracoInt32Array();
  const index = [];
  for (let k = 0; k < mesh.num_faces(); k++) {
    decoder.GetFaceFromMesh(mesh, k, face);
    index.push(face.GetValue(0), face.GetValue(1), face.GetValue(2));
  }
  geometry.setAttribute("position", new three.BufferAttribute(positions, 3));
  geometry.setIndex(index);
  return geometry;
}

const loader = new GLTFLoader();
loader.setDRACOLoader({ preload() {}, decodeDracoFile: (data, done, ids) => done(decode(data, ids)) });
for (const file of files) {
  const bytes = readFileSync(file);
  const start = performance.now();
  const { scene } = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), "");
  const milliseconds = performance.now() - start;
  scene.updateMatrixWorld(true);
  const corners = [];
  let largestIndex = 0;
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { position } = mesh.geometry.attributes;
    for (const vertex of mesh.geometry.index.array) {
      largestIndex = Math.max(largestIndex, vertex);
      const at = new three.Vector3().fromBufferAttribute(position, vertex).applyMatrix4(mesh.matrixWorld);
      corners.push(at.x, at.y, at.z);
    }
  });
  const box = new three.Box3().setFromObject(scene);
  console.log(JSON.stringify({ corners, largestIndex, box: [box.min.toArray(), box.max.toArray()], milliseconds }));
}
