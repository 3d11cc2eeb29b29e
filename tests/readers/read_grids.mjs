// Reads grids of sub-volumes with formats/js. Takes lines of JSON: a manifest and the text of its grid. Prints a code or
// "read" for each.
import { createInterface } from "node:readline";
import { readGrid } from "../../formats/js/core/subvolumes.js";

for await (const line of createInterface({ input: process.stdin })) {
  const { manifest, grid } = JSON.parse(line);
  const pack = { manifest, name: "package", read: async () => new TextEncoder().encode(grid) };
  const said = await readGrid(pack).then(
    () => "read",
    (error) => error.code ?? `no code: ${error.stack}`.replaceAll("\n", " "),
  );
  console.log(said);
}
