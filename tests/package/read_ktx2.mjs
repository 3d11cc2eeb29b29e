// Reads KTX 2 files with ktx-parse and prints what it found, one JSON object a line. Called by test_ktx_parse.py:
//   node read_ktx2.mjs FOLDER_OF_KTX_PARSE FILE...
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, ...files] = process.argv.slice(2);
const { read } = await import(pathToFileURL(`${folder}/node_modules/ktx-parse/dist/index.mjs`));
for (const file of files) {
  const texture = read(new Uint8Array(readFileSync(file)));
  const { levelData } = texture.levels[0];
  const [descriptor] = texture.dataFormatDescriptor;
  const texels = createHash("sha256").update(levelData).digest("hex");
  const levels = texture.levels.map((level) => [level.levelData.byteLength, level.uncompressedByteLength]);
  console.log(
    JSON.stringify({ ...texture, dataFormatDescriptor: undefined, globalData: undefined, descriptor, texels, levels }),
  );
}
