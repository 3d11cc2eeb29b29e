"""Every shader that can be composed: as if one person had written it for one package, and accepted by the driver."""

import hashlib
import re
import shutil
from collections import Counter
from contextlib import ExitStack
from itertools import product

import numpy as np
import pytest
from command_line import ended
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.compositing import COMPOSITINGS
from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic
from volprep.parts.subvolumes.cuts import grid_points
from volprep.render.egl import Context
from volprep.render.gl import Gl
from volprep.render.gl_records import ShaderText
from volprep.scene.scene import BrickSettings, NormalSettings, ProxySettings
from volprep.shading.half_floats import in_half_floats, with_half_coordinates
from volprep.shading.program import compose_program
from volprep.techniques import TECHNIQUES
from volprep_formats.package.manifest import Channel, FileRecord, SubvolumeFiles
from volprep_formats.package.parts.subvolumes.record import Subvolume, SubvolumeGrid, ViewThresholds, encode_grid
from volprep_formats.package.picture import Picture, PictureMedium
from volprep_formats.package.program import Light, ProgramDesign
from volprep_formats.package.reader import Package

GREY = function((0.0, (0.5, 0.5, 0.5), 0.0), (255.0, (1.0, 1.0, 1.0), 1.0)).model_copy(update={"isovalue": 100.0})
RGBA8_ONLY = ES3.model_copy(update={"texture_formats": ("r8unorm", "rg8unorm", "rgb8unorm", "rgba8unorm")})
SMALL = ES2.model_copy(update={"max_texture_size": 64})
"""Holds four tiles of 31×29 texels in a texture."""
OCT8, OCT12, SNORM8 = (NormalSettings(code=code) for code in ("oct8", "oct12", "snorm8"))
BLOCKS, DISTANCE = ("blocks", 4), ("distance", 4)
PREINTEGRATED = {"classification": "preintegrated", "entries": 16}
DEEP = (20, 31, 29)
PACKAGES = {
    "texture3d": (ES3, {}),
    "texture3d-blocks-oct12": (ES3, {"skip": BLOCKS, "normals": OCT12}),
    "texture3d-rgba8": (RGBA8_ONLY, {"skip": BLOCKS, "normals": OCT8}),
    "texture3d-preintegrated": (ES3, {"skip": DISTANCE, "normals": SNORM8, **PREINTEGRATED}),
    "texture3d-preintegrated-rgba8": (RGBA8_ONLY, PREINTEGRATED),
    "texture3d-palette": (ES3, {"classification": "palette", "entries": 5}),
    "texture3d-control-points": (ES3, {"classification": "control-points"}),
    "texture3d-preclassified": (ES3, {"classification": "preclassified", "proxy": None}),
    "bricks": (ES3, {"bricks": BrickSettings(size=4), "proxy": None}),
    "mosaic": (ES2, {}),
    "mosaic-gutter": (ES2, {"packing": Packing(gutter=1), "skip": DISTANCE}),
    "mosaic-in-two": (SMALL, {"shape": (5, 31, 29), "skip": BLOCKS, "normals": OCT8}),
    "mosaic-one-slice": (ES2, {"shape": (1, 4, 3), "skip": DISTANCE}),
    "mosaic-labels": (ES2, {"labels": True}),
    "mosaic-preintegrated": (ES2, PREINTEGRATED),
    "mosaic-palette": (ES2, {"classification": "palette", "entries": 5}),
    "mosaic-control-points": (ES2, {"classification": "control-points"}),
    "mosaic-preclassified": (ES2, {"classification": "preclassified", "proxy": None}),
    "mosaic-interleaved": (ES2, {"packing": Packing(4)}),
    "mosaic-interleaved-in-several": (SMALL, {"packing": Packing(4), "shape": (20, 31, 29), "normals": OCT12}),
    "mosaic-interleaved-labels": (ES2, {"packing": Packing(4), "labels": True}),
    "mosaic-overlapping": (SMALL, {"packing": Packing(4, "overlapping"), "shape": DEEP}),
    "mosaic-overlapping-labels": (ES2, {"packing": Packing(4, "overlapping"), "labels": True}),
    "mosaic-planar": (ES2, {"packing": Packing(4, "planar")}),
    "mosaic-planar-in-two": (SMALL, {"packing": Packing(4, "planar"), "shape": DEEP}),
    "mosaic-planar-labels-in-two": (SMALL, {"packing": Packing(4, "planar"), "shape": DEEP, "labels": True}),
}


PLACE = Light(place_mm_xyz=(1.0, 2.0, 3.0))
LIGHTS = [
    {},
    {"lighting": "headlight"},
    {"lighting": "headlight", "normals_from": "forward"},
    {"lighting": "phong", "light": PLACE},
    {"lighting": "blinn-phong", "light": PLACE, "normals_from": "central"},
]


@pytest.fixture(scope="module", params=PACKAGES.values(), ids=PACKAGES.keys())
def package(request, tmp_path_factory):
    profile, wishes = request.param
    wishes = {"skip": DISTANCE, "normals": NormalSettings(), "proxy": ProxySettings(), **wishes}
    codes = np.random.default_rng(1).integers(0, 256, wishes.pop("shape", (5, 4, 3))).astype(np.uint8)
    return tiny_package(tmp_path_factory.mktemp("composed") / "p", codes, GREY, profile, cutoff=0.99, **wishes)


def designs(package):
    """Every program that the textures and tables of a package allow."""
    (program, *_) = package.manifest.level_programs
    base = {name: getattr(program, name) for name in ProgramDesign.model_fields}
    meshes = ("box",) if package.manifest.proxy is None else ("box", "mesh")
    lights = LIGHTS[:2] if program.classification == "preclassified" else LIGHTS
    for rays, light, compositing in product(meshes, lights, COMPOSITINGS.values()):
        if program.classification not in compositing.classifications or (light and not compositing.lit):
            continue
        if rays == "mesh" and (not compositing.meshes or light not in lights[:2]):
            continue
        # How a normal is found and how a light shines do not depend on the compositing, but on what a sample is.
        if light not in lights[:2] and compositing.name not in {"emission-absorption", "isosurface"}:
            continue
        yield ProgramDesign(**base | light | {"rays": rays, "compositing": compositing.name})
    for technique in TECHNIQUES.values():
        if technique.name == "ray-casting" or program.sampling not in technique.samplings:
            continue
        if program.classification in technique.classifications:
            for light, rays in product(LIGHTS[:2], meshes if technique.meshes else ("box",)):
                yield ProgramDesign(**base | light | {"technique": technique.name, "rays": rays})
    if program.sampling in {"texture3d", "mosaic"} and program.classification != "preclassified":
        for light in ({}, {"lighting": "headlight", "normals_from": "central"}):
            yield ProgramDesign(**base | {"sampling": "subvolumes"} | light)


@pytest.fixture(scope="module")
def composed(package):
    """Vertex and fragment shader of every program, with all that may be left out and without; each pair once."""
    return sorted(set(compose_all(package)))


def with_pieces(package):
    """Add the grid of sub-volumes of one piece, as the level is stored: a 3D texture or a mosaic."""
    manifest, path = package.manifest, "subvolumes/grid.json"
    volume = next(texture for texture in manifest.textures if texture.role == "volume")
    depth, *sides = manifest.grid.shape_zyx
    held, mosaic = volume.mosaic, None
    if held is not None:
        mosaic = fit_mosaic((depth + 1, *sides), Packing(held.slices_per_texel, held.order), Room(256))
    cuts = tuple((0, n - 1) for n in (depth, *sides))
    data = encode_grid(
        SubvolumeGrid(
            shape_zyx=(depth, *sides),
            size=max(depth, *sides, 2),
            cuts_zyx=cuts,
            texture_format=volume.format,
            dimension=volume.dimension,
            filter=volume.filter,
            mosaic=mosaic,
            subvolumes=(Subvolume(minimum=0, maximum=255),),
            points=grid_points(cuts),
            view=ViewThresholds(),
        )
    )
    (package.path / path).parent.mkdir(exist_ok=True)
    (package.path / path).write_bytes(data)
    record = FileRecord(path=path, role="grid", size_bytes=len(data), sha256=hashlib.sha256(data).hexdigest())
    changes = {"files": (*manifest.files, record), "subvolumes": SubvolumeFiles(grid=path)}
    return Package(package.path, manifest.model_copy(update=changes))


def compose_all(package):
    package = with_pieces(package)
    rays = package.manifest.rays(package.manifest.level_programs[0])
    for design, skips, ends_early in product(designs(package), (True, False), (True, False)):
        if ends_early and not COMPOSITINGS[design.compositing].ends_early:
            continue
        if not skips and design.normals_from != "volume":
            continue
        shaders = compose_program(package, design, rays, ends_early=ends_early, skips=skips)
        yield shaders.vertex, shaders.fragment
        yield from ((each.vertex or shaders.vertex, each.fragment) for each in shaders.before)


def with_two_channels(package, *, packed):
    """What a package says that draws two channels together, which share texels or have a texture each."""
    manifest = package.manifest
    (transfer,) = (texture for texture in manifest.textures if texture.role == "transfer")
    (volume,) = (texture for texture in manifest.textures if texture.role == "volume")
    held = [("a", "b")] if packed else [("a",), ("b",)]
    volumes = [volume.model_copy(update={"name": "_".join(each), "channels": each}) for each in held]
    tables = [transfer.model_copy(update={"name": name, "transfer": name}) for name in ("red", "blue")]
    channels = [
        Channel(
            name=name,
            source=manifest.source,
            statistics=manifest.statistics,
            levels=manifest.levels,
            transfer_functions=(manifest.transfer_functions[0].model_copy(update={"name": transfer}),),
        )
        for name, transfer in (("a", "red"), ("b", "blue"))
    ]
    media = tuple(PictureMedium(channel=name, transfer=transfer) for name, transfer in (("a", "red"), ("b", "blue")))
    changes = {
        "textures": (*volumes, *tables),
        "channels": tuple(channels),
        "pictures": (Picture(name="both", media=media, mixing="sum"),),
        "skipping": None,
    }
    return Package(package.path, manifest.model_copy(update=changes))


def wrong_lines(text):
    """Lines that a reader stumbles over, with the reason."""
    depth = 0
    for line in text.splitlines():
        code = re.sub(r"//.*", "", line).strip()
        closing = len(code) - len(code.lstrip(")}"))
        expected = "" if code.startswith("#") else "  " * (depth - closing)
        if line.strip() and line != expected + line.strip():
            yield f"indentation is not {len(expected)}: {line!r}"
        depth += sum(code.count(each) for each in "({") - sum(code.count(each) for each in ")}")
        if depth < 0:
            yield f"closes what is not open: {line!r}"
        if line != line.rstrip():
            yield f"blanks at the end: {line!r}"
        if len(line) > 120:
            yield f"too long: {line!r}"
    if depth:
        yield f"{depth} left open"
    if "\n\n\n" in text or "{\n\n" in text or "\n\n}" in re.sub(r"\n +", "\n", text):
        yield "blank lines that separate nothing"
    if not text.isascii() or re.search(r"\$|//#|//:", text):
        yield "a part was not filled in"


def dead_words(text):
    """Functions, constants, uniforms, inputs and variables that are named once."""
    code = re.sub(r"//.*", "", text)
    kinds = r"(?:float|vec[234]|ivec3|mat4|sampler2D|highp sampler[23]D)"
    times = Counter(re.findall(r"\w+", code))
    for name in re.findall(rf"\b{kinds} (\w+)(?:\[\d+\])?(?: =|\(|;|,|\))", code):
        if times[name] == 1:
            yield name


@pytest.mark.long(keep=5)
def test_every_shader_reads_as_if_one_person_had_written_it(package, composed):
    for text in {text for texts in composed for text in texts}:
        assert not list(wrong_lines(text)), text


@pytest.mark.long(keep=5)
def test_nothing_in_a_shader_is_left_over(composed):
    for vertex, fragment in composed:
        # The vertex shader gives what the fragment shader reads.
        assert not [name for name in dead_words(fragment) if f" {name};" not in vertex], fragment
        assert not list(dead_words(vertex))


@pytest.mark.long(keep=5)
def test_the_driver_takes_every_shader(package, composed):
    with ExitStack() as stack:
        gl = Gl(stack.enter_context(Context(package.manifest.profile.api)))
        for vertex, fragment in composed:
            with gl.program("program", ShaderText("vertex", vertex), ShaderText("fragment", fragment)):
                pass


@pytest.mark.long(keep=3)
@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed")
@pytest.mark.parametrize("numbers", [str, in_half_floats, with_half_coordinates])
def test_the_validator_of_khronos_takes_every_shader(composed, numbers, tmp_path):
    texts = {("vert", vertex) for vertex, _ in composed} | {("frag", numbers(fragment)) for _, fragment in composed}
    files = []
    for number, (ending, text) in enumerate(sorted(texts)):
        files.append(tmp_path / f"{number}.{ending}")
        files[-1].write_text(text, encoding="ascii")
    done = ended(["glslangValidator", *files])
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("profile", "packed"), [(ES3, True), (ES3, False), (ES2, True)], ids=["packed", "apart", "mosaic"]
)
def test_channels_that_are_drawn_together_have_shaders_of_that_kind(tmp_path, profile, packed):
    plain = tiny_package(tmp_path / "p", np.zeros((5, 4, 3), np.uint8), GREY, profile, cutoff=0.99)
    package = with_two_channels(plain, packed=packed)
    (program,) = plain.manifest.level_programs
    design = program.model_copy(update={"transfer": "both"})
    shaders = compose_program(package, design, plain.manifest.rays(program))
    assert not list(wrong_lines(shaders.fragment)), shaders.fragment
    assert not [name for name in dead_words(shaders.fragment) if f" {name};" not in shaders.vertex]
    assert [sampler.transfer for sampler in shaders.samplers][-2:] == ["red", "blue"]
    with ExitStack() as stack:
        gl = Gl(stack.enter_context(Context(profile.api)))
        shader = ShaderText("fragment", shaders.fragment)
        linked = stack.enter_context(gl.program("program", ShaderText("vertex", shaders.vertex), shader))
        assert {each.name for each in (*shaders.uniforms, *shaders.samplers)} == set(linked.uniforms)


def test_what_may_be_left_out_leaves_nothing_behind(tmp_path):
    codes = np.random.default_rng(1).integers(0, 256, (9, 8, 7)).astype(np.uint8)
    plain = tiny_package(tmp_path / "plain", codes, GREY)
    rich = tiny_package(tmp_path / "rich", codes, GREY, skip=DISTANCE, cutoff=0.9)
    (program,) = rich.manifest.level_programs
    left = compose_program(rich, program, rich.manifest.rays(program), ends_early=False, skips=False)
    assert left.fragment == plain.read_text(program.fragment)
    assert (left.uniforms, tuple(each.name for each in left.samplers)) == (
        plain.manifest.level_programs[0].uniforms,
        plain.manifest.level_programs[0].samplers,
    )
