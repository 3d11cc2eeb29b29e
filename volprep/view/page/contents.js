/** Contents of the package: parts, omitted items with the reasons, and sizes. */
import { drawingOf } from "../runtime/fidelity.js";
import { make } from "./dom.js";
import { bytes, voxels } from "./numbers.js";

/** @param {any} manifest */
export function contents(manifest) {
  const size = manifest.files.reduce((/** @type {number} */ sum, /** @type {any} */ each) => sum + each.size_bytes, 0);
  const plan = manifest.plan ?? [];
  const { info } = manifest.channels[0].source;
  const facts = [
    ["Size", `${bytes(size)} in ${manifest.files.length + 1} files`],
    ["For", `${manifest.profile.name} (${apiText(manifest.profile.api)})`],
    [
      "Scan",
      `${info.modality || info.format}, ${voxels(info.grid.shape_zyx)} voxels${manifest.channels.length > 1 ? `, ${manifest.channels.length} channels` : ""}`,
    ],
    [
      "Voxels",
      `${info.grid.spacing_mm_zyx
        .map((/** @type {number} */ each) => Number(each.toPrecision(3)))
        .reverse()
        .join(" × ")} mm`,
    ],
    [
      "Levels",
      manifest.channels[0].levels
        .map((/** @type {any} */ level) => {
          const use = drawingOf(manifest, level.index)?.preview_only ? " (for previews)" : "";
          return `${voxels(level.grid.shape_zyx)}${use}`;
        })
        .join(", "),
    ],
    ["Made by", manifest.generator],
  ];
  return [
    make("dl", {}, ...facts.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)])),
    ...items(
      "Kept",
      plan.filter((/** @type {any} */ each) => each.kept),
    ),
    ...items(
      "Left out",
      plan.filter((/** @type {any} */ each) => !each.kept),
    ),
  ];
}

/** @param {string} title @param {any[]} listed */
function items(title, listed) {
  if (!listed.length) return [];
  const total = listed.reduce((sum, each) => sum + each.size_bytes, 0);
  const rows = listed.map(({ name, channel, size_bytes, reason }) =>
    make(
      "li",
      {},
      make("span", { className: "size" }, size_bytes ? bytes(size_bytes) : ""),
      make(
        "b",
        {},
        channel && listed.some((each) => each.channel !== channel && each.name === name)
          ? `${name} (${channel})`
          : name,
      ),
      make("span", { className: "why" }, reason),
    ),
  );
  return [make("h3", {}, `${title}${total ? `: ${bytes(total)}` : ""}`), make("ul", { className: "plan" }, ...rows)];
}

/** @param {string} api */
const apiText = (api) => (api === "es3.0" ? "OpenGL ES 3.0, WebGL 2" : "OpenGL ES 2.0, WebGL 1");
