// What tests do in a page: open a package, draw pictures, and say what was found. And contexts that lack something.
import { createRenderer, openPackage } from "/js/volpkg.js";

/** A canvas of a size, and its context. */
export function context(kind = "webgl2", width = 48, height = 48, attributes = {}) {
  const canvas = new OffscreenCanvas(width, height);
  return canvas.getContext(kind, attributes);
}

/** Pictures of a package as lists of numbers, each for a matrix; and what the renderer says of itself. */
export async function pictures(
  url,
  {
    kind,
    size = [48, 48],
    options = {},
    matrices,
    edit,
    clip,
    point,
    frame,
    step,
    light,
    segments,
    depth,
    draco,
    broken = [],
    targets = [],
    limits = {},
    without = [],
  },
) {
  const asked = new Set();
  const gl = lacking(context(kind, ...size), broken, targets, limits, without, asked);
  if (draco) options.decodeDraco = await dracoOf(draco);
  const pack = await openPackage(url);
  const renderer = await createRenderer(gl, pack, options);
  await renderer.ready;
  if (point !== undefined) await renderer.setPoint(point);
  if (frame) await renderer.setFrame(frame);
  if (edit) await renderer.setTransfer(edit);
  if (clip) await renderer.setClip(clip);
  if (step) renderer.setStep(step);
  if (light) await renderer.setLight(light);
  if (segments) await renderer.setSegments(segments);
  const opaque = depth === undefined ? undefined : { texture: texel(gl, 255 * depth) };
  const found = matrices.map((boxFromClip) => {
    renderer.draw({ boxFromClip, depth: opaque });
    return toBase64(renderer.readPixels().pixels);
  });
  const { level, levels, step: drawnWith, program, notes, probes, textureBytes } = renderer;
  const said = {
    level,
    levels,
    step: drawnWith,
    program,
    notes,
    probes,
    textureBytes,
    asked: [...asked],
    error: gl.getError(),
  };
  renderer.dispose();
  pack.close();
  return { pictures: found, ...said };
}

/** A decoder: the one of npm's draco3d in a folder, or one that fails. */
async function dracoOf(folder) {
  if (folder === "broken") return () => Promise.reject(new Error("no memory"));
  const { dracoDecoder } = await import("/js/draco.js");
  const script = document.createElement("script");
  script.src = `${folder}/draco_decoder_nodejs.js`;
  const loaded = new Promise((resolve) => (script.onload = resolve));
  document.head.append(script);
  await loaded;
  return dracoDecoder(await DracoDecoderModule({ locateFile: (name) => `${folder}/${name}` }));
}

/** A texture of one grey texel. */
function texel(gl, grey) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4).fill(grey));
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  return texture;
}

export function toBase64(floats) {
  const bytes = new Uint8Array(floats.buffer);
  let text = "";
  for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
  return btoa(text);
}

/** A context of which some calls are replaced; `this` in them is the real one. */
function replaced(gl, calls, values = {}) {
  const kept = new Map();
  return new Proxy(gl, {
    get(target, name) {
      if (name in values) return values[name];
      const found = target[name];
      if (typeof found !== "function") return found;
      if (!kept.has(name)) kept.set(name, (calls[name] ?? found).bind(target));
      return kept.get(name);
    },
  });
}

/**
 * A context that claims everything and does less. `broken`: formats that are black, or that are not filtered; `targets`:
 * formats that keep nothing that is drawn; `limits`: what it says of itself; `without`: extensions that it does not
 * have; `asked` gets those that it has and was asked for.
 */
function lacking(gl, broken, targets, limits, without, asked) {
  const black = new Set(broken.flatMap(([name, how]) => (how === "is black" ? [gl[name]] : [])));
  const unfiltered = new Set(broken.flatMap(([name, how]) => (how === "filters" ? [gl[name]] : [])));
  const compressed = broken.some(([name]) => name.startsWith("COMPRESSED"));
  const format = {};
  const kinds = { RGBA16F: [0x881a], RGBA32F: [0x8814], SRGB8_ALPHA8: [0x8c43] };
  const forgetful = new Set(targets.flatMap((name) => kinds[name] ?? []));
  const half = targets.includes("RGBA16F") ? 0x8d61 : -1;
  /** Textures of half floats of WebGL 1, whose internal format does not tell. */
  const halves = new Set();
  let bound = null;
  const made = new Map();
  const zeros = (data) => (data ? new data.constructor(data.length) : data);
  /** A texture of a format that does not filter gives the nearest texel whatever the page asks for. */
  const nearest = (target) => {
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  };
  const image = (name, internalAt, dataAt) => ({
    [name](...given) {
      const internal = given[internalAt];
      format[given[0]] = internal;
      made.set(bound, internal);
      if (given[7] === half) halves.add(bound);
      if (dataAt && black.has(internal)) given[dataAt] = zeros(given[dataAt]);
      gl[name](...given);
    },
  });
  const part = (name, dataAt) => ({
    [name](...given) {
      if (black.has(format[given[0]]) || black.has(made.get(bound))) given[dataAt] = zeros(given[dataAt]);
      gl[name](...given);
    },
  });
  return replaced(gl, {
    ...image("texImage2D", 2, 8),
    ...image("texImage3D", 2, 9),
    ...image("texStorage2D", 2),
    ...image("texStorage3D", 2),
    ...part("texSubImage2D", 8),
    ...part("texSubImage3D", 10),
    compressedTexImage2D(...given) {
      if (compressed) given[6] = zeros(given[6]);
      gl.compressedTexImage2D(...given);
    },
    bindTexture(target, texture) {
      bound = texture;
      gl.bindTexture(target, texture);
    },
    drawArrays(...given) {
      const active = gl.getParameter(gl.ACTIVE_TEXTURE);
      for (let unit = 0; unit < 16; unit++) {
        gl.activeTexture(gl.TEXTURE0 + unit);
        for (const target of [gl.TEXTURE_2D, gl.TEXTURE_3D ?? gl.TEXTURE_2D]) {
          const texture = gl.getParameter(target === gl.TEXTURE_2D ? gl.TEXTURE_BINDING_2D : gl.TEXTURE_BINDING_3D);
          if (texture && unfiltered.has(made.get(texture))) nearest(target);
        }
      }
      gl.activeTexture(active);
      gl.drawArrays(...given);
      const frame = gl.getParameter(gl.FRAMEBUFFER_BINDING);
      if (frame && forgetful.size) {
        const texture = gl.getFramebufferAttachmentParameter(
          gl.FRAMEBUFFER,
          gl.COLOR_ATTACHMENT0,
          gl.FRAMEBUFFER_ATTACHMENT_OBJECT_NAME,
        );
        if (forgetful.has(made.get(texture)) || halves.has(texture)) {
          gl.clearColor(0, 0, 0, 1);
          gl.clear(gl.COLOR_BUFFER_BIT);
        }
      }
    },
    getExtension(name) {
      const found = gl.getExtension(name);
      if (found) asked.add(name);
      return without.includes(name) ? null : found;
    },
    getParameter(name) {
      const found = Object.entries(limits).find(([limit]) => gl[limit] === name);
      return found ? found[1] : gl.getParameter(name);
    },
  });
}

/** A context that counts what was made and not deleted. */
export function counted(gl) {
  const alive = new Set();
  const calls = {};
  for (const what of ["Texture", "Buffer", "Framebuffer", "Renderbuffer", "Program", "Shader", "VertexArray"]) {
    if (!gl[`create${what}`]) continue;
    calls[`create${what}`] = (...given) => {
      const made = gl[`create${what}`](...given);
      alive.add(made);
      return made;
    };
    calls[`delete${what}`] = (made) => {
      alive.delete(made);
      gl[`delete${what}`](made);
    };
  }
  return replaced(gl, calls, { alive: () => alive.size });
}
