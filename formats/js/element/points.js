/** Points of the ruler as a file, JSON in the patient's space (LPS, millimetres): README.md has its fields. */
import { invert, moved, worldFromBox } from "../camera.js";
import { VolpkgError } from "../core/messages.js";
import { distance } from "./ruler.js";

/** @typedef {import("./stage.js").Stage} Stage */
/**
 * A point of the ruler: a hit, or what a file has of one.
 * @typedef {object} Point
 * @property {number[]} position_mm x, y, z in the patient's space (LPS)
 * @property {number} uncertainty_mm of the depth at the level that was drawn
 * @property {number} level that was drawn
 * @property {number[]} box_mm x, y, z in box millimetres
 * @property {number[]} voxel x, y, z in voxels of level 0
 * @property {number | null} value in the scan's unit
 * @property {string[] | null} segments names of segments
 */

const [FORMAT, VERSION, MOST] = ["volpkg-points", 1, 10_000];

/** The points of a stage as a record for `JSON.stringify`. @param {Stage} stage */
export function pointsRecord({ points, renderer }) {
  const kept = points.map(({ position_mm, uncertainty_mm, level, value, segments }) => ({
    position_mm,
    uncertainty_mm,
    level,
    value,
    segments,
  }));
  const distances = points.slice(1).map((point, i) => {
    const { apart, uncertainty } = distance(points[i], point);
    return { from: i, to: i + 1, mm: apart, uncertainty_mm: uncertainty };
  });
  const { name } = renderer.package.manifest;
  return { format: FORMAT, version: VERSION, package: name, points: kept, distances };
}

/**
 * Replaces the points of a stage by the points of a file. Throws VP7085 for another file.
 * @param {Stage} stage @param {string} text of the file
 */
export function readPoints(stage, text) {
  const { grid } = stage.renderer;
  const boxFromWorld = invert(worldFromBox(grid));
  stage.points = checked(text).map((point) => {
    const box_mm = moved(boxFromWorld, point.position_mm);
    return { ...point, box_mm, voxel: box_mm.map((each, i) => each / grid.spacing_mm_zyx[2 - i] - 0.5) };
  });
  stage.redraw();
}

/** @param {string} text @returns {Omit<Point, "box_mm" | "voxel">[]} */
function checked(text) {
  const fail = (/** @type {string} */ problem) => {
    throw new VolpkgError("VP7085", { problem });
  };
  let found;
  try {
    found = JSON.parse(text);
  } catch {
    fail("the file is not JSON");
  }
  if (found?.format !== FORMAT || found.version !== VERSION) fail(`its format is not ${FORMAT}, version ${VERSION}`);
  if (!Array.isArray(found.points) || found.points.length > MOST) fail(`it has no list of at most ${MOST} points`);
  const names = (/** @type {unknown} */ list) =>
    Array.isArray(list) && list.every((value) => typeof value === "string") ? list : null;
  return found.points.map((/** @type {any} */ point, /** @type {number} */ i) => {
    const { position_mm: place, uncertainty_mm, level, value, segments } = point ?? {};
    const isPlace = Array.isArray(place) && place.length === 3 && place.every(Number.isFinite);
    if (
      !isPlace ||
      !(uncertainty_mm >= 0 && Number.isFinite(uncertainty_mm)) ||
      !(Number.isInteger(level) && level >= 0)
    )
      fail(`point ${i + 1} has no position, uncertainty and level`);
    const known = Number.isFinite(value) ? value : null;
    return { position_mm: place, uncertainty_mm, level, value: known, segments: names(segments) };
  });
}
