"""Draw a volume package. `gl` has the methods and constants of WebGL 2, `folder` is the package."""

import json
import struct

import numpy as np

NAMES = """r8unorm R8 RED LUMINANCE, rg8unorm RG8 RG LUMINANCE_ALPHA, rgb8unorm RGB8 RGB RGB,
rgba8unorm RGBA8 RGBA RGBA, rgb8snorm RGB8_SNORM RGB - BYTE, rgba8snorm RGBA8_SNORM RGBA - BYTE,
rgba8unorm-srgb SRGB8_ALPHA8 RGBA -, r16float R16F RED - HALF_FLOAT, rgba16float RGBA16F RGBA - HALF_FLOAT"""
FORMATS = {name: words for name, *words in map(str.split, NAMES.split(","))}  # "-": not in OpenGL ES 2.0


def choose(folder, name, level, frame):  # steps 1 and 2
    """Return the manifest, a drawing, its program and its grid: of the default picture and finest level for None."""
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert (manifest["format"], manifest["version"][:2], manifest["state"]) == ("volpkg", "1.", "sealed")
    picture = next(picture for picture in manifest["pictures"] if name in (None, picture["name"]))
    drawing = next(d for d in picture["drawings"] if level in (None, d["level"]) and frame == d.get("frame", 0))
    program = next(program for program in manifest["programs"] if program["name"] == drawing["program"])
    return manifest, drawing, program, picture.get("grid", manifest["grid"])


def link(gl, folder, program):  # step 3
    handle = gl.createProgram()
    for kind, path in ((gl.VERTEX_SHADER, program["vertex"]), (gl.FRAGMENT_SHADER, program["fragment"])):
        shader = gl.createShader(kind)
        gl.shaderSource(shader, (folder / path).read_text(encoding="utf-8"))
        gl.compileShader(shader)
        gl.attachShader(handle, shader)
    gl.bindAttribLocation(handle, 0, "a_ndc")
    gl.linkProgram(handle)
    assert gl.getProgramParameter(handle, gl.LINK_STATUS), gl.getProgramInfoLog(handle)
    return handle


def upload(gl, folder, manifest, name):  # steps 4 and 5
    texture = next(texture for texture in manifest["textures"] if texture["name"] == name)
    target, handle = getattr(gl, f"TEXTURE_{texture['dimension'].upper()}"), gl.createTexture()
    internal, pixels, old, kind = (*FORMATS[texture["format"]], "UNSIGNED_BYTE")[:4]
    names = (old, old, kind) if manifest["profile"]["api"] == "es2.0" else (internal, pixels, kind)
    internal, *pixels = (getattr(gl, name) for name in names)
    gl.bindTexture(target, handle)
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1)
    data = (folder / texture["file"]).read_bytes()
    mipmaps = [record for record in manifest["textures"] if record["file"] == texture["file"]]
    for index, mipmap in enumerate(mipmaps):
        offset, length = struct.unpack_from("<2Q", data, 80 + 24 * index)
        size = mipmap["shape_zyx"][::-1][: 3 if target == gl.TEXTURE_3D else 2]
        getattr(gl, f"texImage{len(size)}D")(target, index, internal, *size, 0, *pixels, data[offset : offset + length])
    near = texture["filter"].upper()  # LINEAR or NEAREST
    far = f"{near}_MIPMAP_{near}" if len(mipmaps) > 1 else near
    gl.texParameteri(target, gl.TEXTURE_MAX_LEVEL, len(mipmaps) - 1)
    wraps = dict.fromkeys(("WRAP_S", "WRAP_T", "WRAP_R"), "CLAMP_TO_EDGE")
    for key, word in {"MAG_FILTER": near, "MIN_FILTER": far, **wraps}.items():
        gl.texParameteri(target, getattr(gl, f"TEXTURE_{key}"), getattr(gl, word))
    return target, handle


def world_from_box(grid):  # step 7
    direction = np.array(grid["direction"])  # stored row by row; its columns are the axes of the box
    corner = grid["origin_mm_xyz"] - direction @ np.array(grid["spacing_mm_zyx"][::-1]) / 2
    return np.vstack([np.column_stack([direction, corner]), [0, 0, 0, 1]])


def draw(gl, folder, clip_from_world, size, picture=None, level=None, frame=0):
    """Draw one picture of width and height `size` into the framebuffer that is bound."""
    manifest, drawing, program, grid = choose(folder, picture, level, frame)
    handle = link(gl, folder, program)
    uploaded = [upload(gl, folder, manifest, name) for name in drawing["textures"]]
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer())  # step 6
    gl.bufferData(gl.ARRAY_BUFFER, np.array([-1, -1, 3, -1, -1, 3], np.float32), gl.STATIC_DRAW)
    gl.enableVertexAttribArray(0)
    gl.vertexAttribPointer(0, 2, gl.FLOAT, False, 0, 0)
    values = {value["source"]: value["numbers"] for value in drawing["values"]} | {  # step 8
        "box_from_clip": np.linalg.inv(clip_from_world @ world_from_box(grid)),
        "step_mm": drawing["step_mm"],
    }
    gl.useProgram(handle)  # step 9
    for uniform in program["uniforms"]:
        location = gl.getUniformLocation(handle, uniform["name"])
        value = np.array(values[uniform["source"]], np.float32).T.ravel()  # matrices column by column
        kind = {"f32": "1fv", "vec3f": "3fv", "mat4x4f": "Matrix4fv"}[uniform["type"]]
        getattr(gl, f"uniform{kind}")(location, *[False] * (kind == "Matrix4fv"), value)
    for unit, (sampler, (target, texture)) in enumerate(zip(program["samplers"], uploaded)):
        gl.activeTexture(gl.TEXTURE0 + unit)
        gl.bindTexture(target, texture)
        gl.uniform1i(gl.getUniformLocation(handle, sampler), unit)
    gl.viewport(0, 0, *size)  # step 10
    gl.drawArrays(gl.TRIANGLES, 0, 3)
