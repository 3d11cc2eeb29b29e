"""The listings of formats/spec run: the reader draws as volprep does, JavaScript uploads the same."""

import json
import re
import types
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from command_line import ended
from every_kind import write_segments, write_together
from format_samples import LARGEST, SAMPLES, SIDE, differing
from phantom_scene import write_phantom_scene
from scene_builds import built
from webgl import WebGl

from volprep.render.bindings import GLES3
from volprep.render.egl import context
from volprep.render.gl_formats import TARGETS, gl_format
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.picture import encoded
from volprep_formats.grid import Grid
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2

SPEC = Path(__file__).parents[2] / "formats" / "spec"
WEBGL = (SPEC / "webgl.md").read_text(encoding="utf-8")
SIZE = (40, 30)
EIGHT_BITS = 0.5 / 255
"""What an 8-bit canvas rounds; pow of the software driver is off by 7e-4."""
FLOAT32 = 1e-5
"""Matrices are inverted twice, so that rays begin some float32 roundings away."""


def listing(language: str) -> str:
    (text,) = re.findall(rf"^```{language}\n(.*?)^```$", WEBGL, re.MULTILINE | re.DOTALL)
    return text


@pytest.fixture
def no_gl_object_leaks() -> None:
    """Nothing: the reader of the text leaves its objects to the context, which ends."""


@pytest.fixture(scope="module")
def reader() -> types.ModuleType:
    text = (SPEC / "reader.py").read_text(encoding="utf-8")
    assert text.count("\n") <= 90
    module = types.ModuleType("reader")
    exec(compile(text, "reader.py", "exec"), module.__dict__)  # noqa: S102 - the text is ours
    return module


def phantom(extra: str) -> Callable[[Path], Path]:
    return partial(write_phantom_scene, more=f"\n{extra}")


SCENES = {
    "two transfer functions": phantom(""),
    "lit, skipping": phantom('[render]\nlighting = "headlight"\n[skip]\nkind = "distance"\n'),
    "mipmaps": phantom("[textures]\nmipmaps = true\n"),
    "pre-integrated": phantom('[render]\nclassification = "preintegrated"\n'),
    "several channels": write_together,
    "segments": write_segments,
}


@pytest.fixture(scope="module", params=SCENES.values(), ids=SCENES)
def package(request, tmp_path_factory) -> Package:
    folder = tmp_path_factory.mktemp("spec")
    scene = request.param(folder)
    return built(scene, folder / "p.volpkg")


def float_target(size: tuple[int, int] = SIZE) -> None:
    texture, framebuffer = GLES3.glGenTextures(1), GLES3.glGenFramebuffers(1)
    GLES3.glBindTexture(GLES3.GL_TEXTURE_2D, texture)
    GLES3.glTexStorage2D(GLES3.GL_TEXTURE_2D, 1, GLES3.GL_RGBA32F, *size)
    GLES3.glBindFramebuffer(GLES3.GL_FRAMEBUFFER, framebuffer)
    attachment = (GLES3.GL_COLOR_ATTACHMENT0, GLES3.GL_TEXTURE_2D)
    GLES3.glFramebufferTexture2D(GLES3.GL_FRAMEBUFFER, *attachment, texture, 0)


def read_pixels(kind: int, dtype: type, size: tuple[int, int] = SIZE) -> np.ndarray:
    picture = np.empty((size[1], size[0], 4), dtype)
    GLES3.glReadPixels(0, 0, *size, GLES3.GL_RGBA, kind, picture)
    return picture[::-1]


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("view", ["anterior", "posterior-left"])
def test_the_reader_of_the_text_draws_every_level_as_volprep_does(package, reader, view) -> None:
    grid = package.manifest.grid
    camera = standard_views(grid)[view]
    aspect = SIZE[0] / SIZE[1]
    for level in package.manifest.levels:
        with Renderer(package, level=level.index, target="rgba32f") as renderer:
            wanted = renderer.render(camera.box_from_clip(grid, aspect), SIZE[::-1])
        with context("es3.0"):
            float_target()
            reader.draw(WebGl(), package.path, np.linalg.inv(camera.world_from_clip(aspect)), SIZE, level=level.index)
            found = read_pixels(GLES3.GL_FLOAT, np.float32)
        assert wanted[..., 3].max() > 0.3
        np.testing.assert_allclose(found, wanted, rtol=0, atol=FLOAT32)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", sorted(set(SAMPLES) - {"slices", "sub-volumes-point", "slabs"}))
def test_the_reader_of_the_text_draws_the_picture_of_a_sample(name, reader, tmp_path) -> None:
    sample, size = SAMPLES[name], (SIDE, SIDE)
    with zipfile.ZipFile(sample.package) as file:
        file.extractall(tmp_path)
    with context("es3.0"):
        float_target(size)
        reader.draw(WebGl(), tmp_path, sample.clip_from_world, size, frame=sample.frame)
        found = read_pixels(GLES3.GL_FLOAT, np.float32, size)
    assert differing(encoded(found, "black"), sample) <= LARGEST


@pytest.fixture(scope="module")
def ball(tmp_path_factory) -> Package:
    folder = tmp_path_factory.mktemp("javascript")
    return built(phantom("")(folder), folder / "p.volpkg")


def run_javascript(tmp_path: Path, body: str) -> list[list[object]]:
    """Run the listing with a `gl` that prints what it is asked to do; constants are their names."""
    script = tmp_path / "listing.mjs"
    script.write_text(
        f"""import {{ readFileSync }} from "node:fs";
        {listing("js")}
        const middle = (each) => [each.constructor.name, each.length, each[each.length >> 1]];
        const simple = (each) => ArrayBuffer.isView(each) ? middle(each) : each;
        const print = (...call) => console.log(JSON.stringify(call.map(simple)));
        const call = (name) => (...values) => print(name, ...values);
        const gl = new Proxy({{}}, {{ get: (_, name) => /^[A-Z]/.test(name) ? name : call(name) }});
        {body}"""
    )
    done = ended(["node", str(script)])
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.long
def test_the_javascript_uploads_the_texels_of_each_texture_as_the_manifest_says(ball, tmp_path) -> None:
    arrays = {"UNSIGNED_BYTE": ("Uint8Array", np.uint8), "HALF_FLOAT": ("Uint16Array", np.uint16)}
    for record in ball.manifest.textures:
        texels = ktx2.decode(ball.read_bytes(record.file), record.file).data
        text = json.dumps(record.model_dump(mode="json"))
        body = f"""const data = readFileSync("{ball.path / record.file}");
        upload(gl, {text}, data.buffer.slice(data.byteOffset, data.byteOffset + data.length));"""
        (call,) = [call for call in run_javascript(tmp_path, body) if call[0].startswith("texImage")]
        depth, height, width = record.shape_zyx
        size = [width, height, depth] if record.dimension == "3d" else [width, height]
        internal, pixels, kind = gl_format(record.format, "es3.0")
        array, dtype = arrays[kind]
        flat = np.frombuffer(np.ascontiguousarray(texels).tobytes(), dtype)
        assert call == [
            f"texImage{len(size)}D",
            *(TARGETS[record.dimension], 0, internal, *size, 0, pixels, kind),
            [array, flat.size, int(flat[flat.size // 2])],
        ]


def test_the_javascript_makes_the_matrix_of_a_turned_volume(tmp_path) -> None:
    turned = ((0.0, 0.6, -0.8), (1.0, 0.0, 0.0), (0.0, -0.8, -0.6))
    grid = Grid.of((5, 7, 9), (2.5, 0.7, 0.3), (-12.0, 30.0, 4.5), turned)
    ((_, matrix),) = run_javascript(tmp_path, f'print("m", worldFromBox({json.dumps(grid.model_dump(mode="json"))}));')
    np.testing.assert_allclose(np.reshape(matrix, (4, 4)).T, grid.world_from_box, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("extension", "wanted"), [("{}", "RGBA16F"), ("null", "SRGB8_ALPHA8")])
def test_the_linear_target_does_without_float_targets(tmp_path, extension, wanted) -> None:
    body = f"""const real = new Proxy(gl, {{ get: (gl, name) =>
        name === "getExtension" ? () => ({extension}) : gl[name] }});
    linearTarget(real, 40, 30);"""
    calls = run_javascript(tmp_path, body)
    assert ["texStorage2D", "TEXTURE_2D", 1, wanted, 40, 30] in calls


def test_the_present_shader_encodes_srgb_over_a_linear_background(ball) -> None:
    picture = np.random.default_rng(3).uniform(0.0, 1.0, (SIZE[1], SIZE[0], 4)).astype(np.float32)
    picture[..., :3] *= picture[..., 3:]
    background = np.array([0.2, 0.0, 0.5], np.float32)
    with context("es3.0"):
        gl = WebGl()
        source = gl.createTexture()
        gl.bindTexture(gl.TEXTURE_2D, source)
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, *SIZE)
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, *SIZE, gl.RGBA, gl.FLOAT, picture)
        program = present_program(gl, ball.read_text(ball.manifest.level_programs[0].vertex))
        float_target()
        gl.bindTexture(gl.TEXTURE_2D, source)
        gl.useProgram(program)
        gl.uniform3fv(gl.getUniformLocation(program, "u_background"), background)
        corners = np.array([-1, -1, 3, -1, -1, 3], np.float32)
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer())
        gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW)
        gl.enableVertexAttribArray(0)
        gl.vertexAttribPointer(0, 2, gl.FLOAT, False, 0, 0)
        gl.viewport(0, 0, *SIZE)
        gl.drawArrays(gl.TRIANGLES, 0, 3)
        found = read_pixels(GLES3.GL_FLOAT, np.float32)[::-1]
    light = picture[..., :3] + (1 - picture[..., 3:]) * background
    wanted = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(found[..., :3], wanted, rtol=0, atol=EIGHT_BITS)


def present_program(gl: WebGl, vertex: str) -> int:
    """Link the present shader of the text with the vertex shader of a package."""
    program = gl.createProgram()
    for kind, text in ((gl.VERTEX_SHADER, vertex), (gl.FRAGMENT_SHADER, listing("glsl"))):
        shader = gl.createShader(kind)
        gl.shaderSource(shader, text)
        gl.compileShader(shader)
        gl.attachShader(program, shader)
    gl.bindAttribLocation(program, 0, "a_ndc")
    gl.linkProgram(program)
    assert gl.getProgramParameter(program, gl.LINK_STATUS), gl.getProgramInfoLog(program)
    return int(program)
