/** Lends the renderer of a stage to a measurement, which draws off the screen; the picture stands still meanwhile. */
import { drawingOf } from "../runtime/fidelity.js";
import { showProblem } from "./problems.js";

/** @typedef {import("../runtime/stage.js").Stage} Stage */

/**
 * @template T
 * @param {Stage} stage
 * @param {number} size width and height of the pictures
 * @param {(bench: import("./measuring.js").Bench) => Promise<T>} work
 */
export async function lend(stage, size, work) {
  const { renderer, gl } = stage;
  const { program, level, step, packageStep } = renderer;
  const targets = [target(gl, size), target(gl, size)];
  const resize = (/** @type {number} */ wanted) => {
    for (const [index, each] of targets.entries()) {
      each.free();
      targets[index] = target(gl, wanted);
    }
  };
  stage.busy = true;
  stage.still();
  try {
    return await work(benchOf(stage, targets, resize));
  } finally {
    for (const target of targets) target.free();
    await renderer.setProgram(program).catch(showProblem);
    await renderer.setLevel(level).catch(showProblem);
    renderer.setStep(step === packageStep ? undefined : step);
    stage.busy = false;
    stage.redraw();
  }
}

/**
 * What a measurement draws with.
 * @param {Stage} stage @param {ReturnType<typeof target>[]} targets @param {(size: number) => void} resize
 * @returns {import("./measuring.js").Bench}
 */
function benchOf({ renderer, gl }, targets, resize) {
  let last = targets[0];
  const found = () =>
    Object.entries(renderer.probes.found).map(([name, { works, found: is, expected }]) => {
      return { name, passed: works, note: works ? "" : `gives ${is} in place of ${expected}` };
    });
  return {
    gl,
    manifest: renderer.package.manifest,
    get probes() {
      return found();
    },
    choose: async (transfer, level) => {
      if (renderer.program !== transfer) await renderer.setProgram(transfer);
      if (renderer.level !== level) await renderer.setLevel(level);
      if (renderer.program !== transfer || renderer.level !== level) {
        throw new Error(`level ${level} of ${transfer} cannot be drawn here`);
      }
    },
    draw: (rows, stepMm, index) => {
      if (renderer.step !== stepMm) renderer.setStep(stepMm);
      last = targets[index % 2];
      renderer.draw({ boxFromClip: columns(rows), viewport: [0, 0, last.size, last.size], target: last.frame });
    },
    wait: () => {
      gl.bindFramebuffer(gl.FRAMEBUFFER, last.frame);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    },
    pixels: () => {
      const { size } = last;
      const pixels = new Uint8Array(4 * size * size);
      gl.bindFramebuffer(gl.FRAMEBUFFER, last.frame);
      gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      return upright(pixels, size);
    },
    resize,
    form: (transfer, level) => form(renderer.package.manifest, transfer, level),
  };
}

/** Technique, and format of the voxels of a level. @param {any} manifest @param {string} transfer @param {number} level */
function form(manifest, transfer, level) {
  const drawing = drawingOf(manifest, level, transfer);
  const program = manifest.programs.find((/** @type {any} */ program) => program.name === drawing?.program);
  const voxels = manifest.textures.filter(
    (/** @type {any} */ each) => drawing?.textures.includes(each.name) && ["volume", "slices"].includes(each.role),
  );
  const told = voxels.map((/** @type {any} */ voxel) => {
    const { format, dimension, bricks, role } = voxel;
    const held = role === "slices" ? "slices" : dimension === "2d" ? "mosaic" : bricks ? "bricks" : "3D texture";
    return `${format} ${held}`;
  });
  return [program?.technique ?? "slices", ...new Set(told)].join(", ");
}

/** A target of 8 bits, as that of validation. @param {any} gl @param {number} size */
function target(gl, size) {
  const texture = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, size, size, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  const frame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  const free = () => {
    gl.deleteFramebuffer(frame);
    gl.deleteTexture(texture);
  };
  return { frame, size, free };
}

/** A matrix that is listed row by row, column by column. @param {number[]} rows */
const columns = (rows) => rows.map((_, at) => rows[4 * (at % 4) + (at >> 2)]);

/** Row 0 on top. @param {Uint8Array} pixels @param {number} size */
function upright(pixels, size) {
  const row = 4 * size;
  const turned = new Uint8Array(pixels.length);
  for (let y = 0; y < size; y++) turned.set(pixels.subarray(y * row, (y + 1) * row), (size - 1 - y) * row);
  return turned;
}
