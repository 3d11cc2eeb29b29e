/**
 * Light of an edited transfer function: ambient occlusion, computed again on the device while frames go on. The
 * package's own shader reads the values of the volume.
 */
import { sampled } from "./edit.js";
import { texelBytes } from "../gl/ktx2.js";
import { placeIn } from "./skip.js";
import { sweeps } from "./sweep.js";
import { drawValues, valueOf, valueProgram, windowOf } from "../draw/values.js";

/** @typedef {import("../core/renderer.js").Renderer} Renderer */
/** @typedef {readonly [z: number, y: number, x: number]} Shape */
/**
 * Cubic cells over the box of a volume, x fastest.
 * @typedef {object} Cells
 * @property {Float32Array} light part of the sky that each cell sees
 * @property {Float32Array} extinction of each cell, per millimetre
 * @property {readonly number[]} shape cells along x, y and z
 * @property {number} cellMm length of an edge
 * @property {readonly number[]} extent of the box along x, y and z, in millimetres
 */
/** @typedef {import("../core/types.js").Texture} Texture */
/** @typedef {import("../core/types.js").TransferFunction} TransferFunction */

/** Cells of 64³: a sweep over them takes about 2 ms. */
const MOST_CELLS = 1 << 18;
/** Least length of an edge of a cell, in voxels along their shortest axis. */
const CELL_VOXELS = 2;
/** Weight of a cell without matter. */
const EMPTY = 1e-6;
/** Values along each edge of a cell, whose mean extinction counts. */
const EACH = 2;
const ENTRIES = 4096;
const MAIN = `uniform vec3 u_cells;
uniform float u_cell_mm;
uniform float u_layer;
uniform vec3 u_extent;
void main() {
  vec3 place = vec3(mod(gl_FragCoord.x, u_cells.x), gl_FragCoord.y, u_layer + floor(gl_FragCoord.x / u_cells.x) + 0.5) * u_cell_mm;
  vec3 within = step(vec3(0.0), place) * step(place, u_extent);
  float inside = within.x * within.y * within.z;
  float value = stored_value(position(clamp(place, vec3(0.0), u_extent)));
`;

/**
 * Computes the light of an edited function in the background, and draws with it.
 * @param {any} state the renderer; its own members are used, too @param {string} name of the function
 */
export async function relight(state, name) {
  const edit = state._changes.edits.get(name);
  // Resolved when there is time for a step of a few milliseconds; false if the edit is outdated.
  const pause = async () => {
    await new Promise((resolve) => setTimeout(resolve));
    return state._levels.drawn && state._changes.edits.get(name) === edit;
  };
  try {
    const lights = edit && (await occlusionTexels(state, edit, pause));
    if (!lights) return;
    edit.lights = lights;
    state._changes.version++;
    await state._levels.refresh();
  } catch (error) {
    if (state._levels.drawn) state.inside.options.onError?.(error);
  }
}

/**
 * Texels of the light of an edited function, for each of its textures.
 * @param {Renderer} renderer @param {TransferFunction} edit
 * @param {() => Promise<boolean>} pause before each step; false ends the work
 * @returns {Promise<Map<string, Uint8Array> | null>} by texture; null if it was ended, or the shader reads no values
 */
async function occlusionTexels(renderer, edit, pause) {
  const textures = renderer.package.manifest.textures.filter(({ light, transfer }) => light && transfer === edit.name);
  const linked = textures.length ? await valueProgram(renderer, "occlusion", MAIN) : null;
  if (!linked) return null;
  const extent = [...renderer.grid.extent_mm_zyx].reverse();
  const spacing = Math.min(...renderer.grid.spacing_mm_zyx);
  const cellMm = Math.max(CELL_VOXELS * spacing, Math.cbrt((extent[0] * extent[1] * extent[2]) / MOST_CELLS));
  const shape = extent.map((mm) => Math.ceil(mm / cellMm));
  const extinction = new Float32Array(shape[0] * shape[1] * shape[2]);
  const table = sampled(edit, windowOf(renderer), ENTRIES);
  for (let layer = 0; layer < shape[2]; layer++) {
    if (!(await pause())) return null;
    addLayer(renderer, linked, { shape, cellMm, extent, layer }, table, extinction);
  }
  /** @type {Float32Array} */
  let light = new Float32Array();
  for (light of sweeps(extinction, shape, cellMm, textures[0].light?.model.radius_mm ?? Infinity)) {
    if (!(await pause())) return null;
  }
  return new Map(
    textures.map((texture) => [texture.name, texelsOf(texture, { light, extinction, shape, cellMm, extent })]),
  );
}

/**
 * Reads the values of a layer of cells, and keeps the mean extinction of each.
 * @param {Renderer} renderer @param {import("../gl/program.js").Linked} linked
 * @param {{shape: number[], cellMm: number, extent: number[], layer: number}} where
 * @param {Float64Array} table @param {Float32Array} extinction
 */
function addLayer(renderer, linked, { shape: [nx, ny], cellMm, extent, layer }, table, extinction) {
  const size = /** @type {const} */ ([EACH * EACH * nx, EACH * ny]);
  const pixels = drawValues(renderer, linked, size, (gl, { locations }) => {
    gl.uniform3f(locations.u_cells, EACH * nx, 0, 0);
    gl.uniform1f(locations.u_cell_mm, cellMm / EACH);
    gl.uniform1f(locations.u_layer, EACH * layer);
    gl.uniform3fv(locations.u_extent, new Float32Array(extent));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  });
  for (let i = 0; i < size[0] * size[1]; i++) {
    if (!pixels[4 * i + 3]) continue;
    const x = Math.floor((i % (EACH * nx)) / EACH);
    const y = Math.floor(Math.floor(i / size[0]) / EACH);
    const entry = Math.round(valueOf(pixels, i) * (ENTRIES - 1));
    extinction[(layer * ny + y) * nx + x] += table[4 * entry + 3] / EACH ** 3;
  }
}

/**
 * Codes of the light at the nodes of a texture, whose outer ones lie on the faces of the box. Both ends of the share
 * are the same.
 * @param {Texture} texture @param {Cells} cells
 */
function texelsOf(texture, cells) {
  const { mosaic, shape_zyx: own, gl, light: stored } = texture;
  const [slices, ...layer] = mosaic ? [mosaic.slices, ...mosaic.tile_shape_yx] : own;
  // Of light that turns, each half of the slices is an end.
  const nodes = /** @type {Shape} */ ([stored?.model.turnable ? slices / 2 : slices, ...layer]);
  const bytes = texelBytes(gl.internal_format, own);
  const components = bytes / (own[0] * own[1] * own[2]);
  const texels = new Uint8Array(bytes);
  const place = placeIn(texture, [slices, nodes[1], nodes[2]]);
  const { largest = 1, subtracted = 0 } = stored ?? {};
  const light = lightAt(nodes, cells);
  let i = 0;
  for (let z = 0; z < slices; z++)
    for (let y = 0; y < nodes[1]; y++)
      for (let x = 0; x < nodes[2]; x++) {
        const code = Math.min(Math.round((255 * (light[i++ % light.length] + subtracted)) / largest), 255);
        texels.fill(code, components * place(z, y, x), components * (place(z, y, x) + 1));
      }
  return texels;
}

/**
 * Light at nodes: the mean of the cells around each, as far as the next node. If texels are larger than cells, a cell
 * has the weight that it has in pictures from all sides, its extinction times its light. With equal weights, the empty
 * space around a body brightens its surface: errors are three times as large with texels of a quarter of the resolution.
 * @param {Shape} nodes @param {Cells} cells
 */
function lightAt(nodes, { light, extinction, shape, cellMm, extent }) {
  const steps = extent.map((each, axis) => each / Math.max(nodes[2 - axis] - 1, 1) / cellMm);
  const isCoarser = steps[0] * steps[1] * steps[2] > 1;
  let weights = light.map((each, i) => (isCoarser ? EMPTY + each * extinction[i] : 1));
  let sums = light.map((each, i) => each * weights[i]);
  const now = [...shape];
  for (const axis of [0, 1, 2]) {
    const count = nodes[2 - axis];
    [weights, sums] = [weights, sums].map((value) => gathered(value, now, axis, count, steps[axis]));
    now[axis] = count;
  }
  return sums.map((each, i) => each / weights[i]);
}

/**
 * Sums of cells along an axis at nodes; the weight of a cell falls linearly to 0 at the next node, or at the next cell
 * if that is farther away.
 * @param {Float32Array} cells @param {readonly number[]} shape x first @param {number} axis
 * @param {number} count of nodes @param {number} step from node to node, in cells
 */
function gathered(cells, shape, axis, count, step) {
  const stride = shape.slice(0, axis).reduce((product, each) => product * each, 1);
  const length = shape[axis];
  const outer = cells.length / stride / length;
  const reach = Math.max(1, step);
  const sums = new Float32Array(stride * count * outer);
  for (let node = 0; node < count; node++) {
    const place = node * step - 0.5;
    const last = Math.min(Math.floor(place + reach), length - 1);
    for (let cell = Math.max(Math.ceil(place - reach), 0); cell <= last; cell++) {
      const weight = 1 - Math.abs(cell - place) / reach;
      for (let o = 0; o < outer; o++)
        for (let i = 0; i < stride; i++)
          sums[(o * count + node) * stride + i] += weight * cells[(o * length + cell) * stride + i];
    }
  }
  return sums;
}
