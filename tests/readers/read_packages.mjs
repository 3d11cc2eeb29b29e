// Reads packages with formats/js as a page does, digests included. Prints a line "CODE" for each, or "read".
import { readFile } from "node:fs/promises";
import { createInterface } from "node:readline";
import { openPackage } from "../../formats/js/volpkg.js";

async function read(path) {
  const file = await readFile(path);
  const pack = await openPackage(new Blob([file]));
  for (const each of pack.manifest.files) await pack.read(each.path);
}

for await (const path of createInterface({ input: process.stdin })) {
  const said = await read(path).then(
    () => "read",
    (error) => error.code ?? `no code: ${error.stack}`.replaceAll("\n", " "),
  );
  console.log(said);
}
