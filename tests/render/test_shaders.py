"""The text of the shaders: specialised, and nothing in it that is not used."""

import re
from contextlib import ExitStack

import numpy as np
import pytest
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.parts.mosaic.packing import Packing
from volprep.render.egl import Context
from volprep.render.gl import Gl
from volprep.render.gl_records import ShaderText
from volprep.shading.compose import compose, literal
from volprep_formats.diagnostics import VolprepError

GREY = function((0.0, (0.5, 0.5, 0.5), 0.0), (255.0, (1.0, 1.0, 1.0), 1.0))
RGBA8_ONLY = ES3.model_copy(update={"texture_formats": ("r8unorm", "rgba8unorm")})
SMALL = ES2.model_copy(update={"max_texture_size": 64})
"""Holds four tiles of 31×29 texels in a texture."""
ONE, FOUR = Packing(), Packing(4)
OVERLAPPING, PLANAR = Packing(4, "overlapping"), Packing(4, "planar")
VARIANTS = {
    "texture3d": (ES3, ONE, (5, 4, 3), None),
    "texture3d-rgba8": (RGBA8_ONLY, ONE, (5, 4, 3), 0.99),
    "mosaic-scan-1": (ES2, ONE, (5, 4, 3), None),
    "mosaic-gutter-1": (ES2, Packing(gutter=1), (5, 4, 3), None),
    "mosaic-in-1-two": (SMALL, ONE, (5, 31, 29), None),
    "mosaic-scan-4": (ES2, FOUR, (5, 4, 3), 0.99),
    "mosaic-in-4-seven": (SMALL, FOUR, (101, 31, 29), 0.99),
    "mosaic-overlapping": (ES2, OVERLAPPING, (5, 4, 3), 0.99),
    "mosaic-overlapping-in-two": (SMALL, OVERLAPPING, (20, 31, 29), 0.99),
    "mosaic-planar": (ES2, PLANAR, (5, 4, 3), 0.99),
    "mosaic-planar-in-two": (SMALL, PLANAR, (20, 31, 29), 0.99),
    "mosaic-slice-1": (ES2, ONE, (1, 4, 3), 0.99),
    "mosaic-slice-4": (ES2, FOUR, (1, 4, 3), None),
}


@pytest.fixture(params=VARIANTS.values(), ids=VARIANTS.keys())
def package(request, tmp_path):
    profile, packing, shape, cutoff = request.param
    return tiny_package(tmp_path / "p", np.zeros(shape, np.uint8), GREY, profile, packing=packing, cutoff=cutoff)


def texts(package):
    program = package.manifest.level_programs[0]
    return {path: package.read_text(path) for path in (program.vertex, program.fragment)}


def test_every_uniform_and_sampler_is_active_and_none_is_unnamed(package):
    program = package.manifest.level_programs[0]
    shaders = [ShaderText(path, text) for path, text in texts(package).items()]
    with ExitStack() as stack:
        gl = Gl(stack.enter_context(Context(package.manifest.profile.api)))
        active = stack.enter_context(gl.program(program.name, *shaders)).uniforms
    declared = set(re.findall(r"uniform (?:\w+ )?\w+ (\w+);", "".join(texts(package).values())))
    named = {*(each.name for each in program.uniforms), *program.samplers}
    assert set(active) == declared == named


def test_every_function_and_constant_is_used(package):
    for text in texts(package).values():
        code = re.sub(r"//.*", "", text)
        names = re.findall(r"^(?:float|vec[234]) (\w+)\(|^const \w+ (\w+)", code, re.MULTILINE)
        for name in map("".join, names):
            assert len(re.findall(rf"\b{name}\b", code)) > 1, f"{name} is dead"


def test_text_is_ascii_and_complete(package):
    # GLSL ES 1.00 knows no other characters, and what begins with $ or //# was not filled in.
    for text in texts(package).values():
        assert text.isascii()
        assert "$" not in text
        assert "//#" not in text
        assert "//:" not in text
        assert text.startswith("#version 100\n" if package.manifest.profile.api == "es2.0" else "#version 300 es\n")
        assert all(len(line) <= 120 for line in text.splitlines())


def test_a_ray_stops_early_only_where_the_plan_has_a_cutoff(package):
    cutoff = package.manifest.opacity_cutoff
    fragment = package.read_text(package.manifest.level_programs[0].fragment)
    assert fragment.count("least_transmittance") == (0 if cutoff is None else 3)
    assert ("0.01 * pow(" in fragment) == (cutoff is not None)


def test_one_slice_needs_no_interpolation_between_slices(package):
    fragment = package.read_text(package.manifest.level_programs[0].fragment)
    one_slice = package.manifest.levels[0].grid.shape_zyx[0] == 1
    assert ("LAST_SLICE" in fragment) == (package.manifest.profile.api == "es2.0" and not one_slice)


def test_one_channel_needs_no_choice_of_channel(tmp_path):
    package = tiny_package(tmp_path / "p", np.zeros((5, 4, 3), np.uint8), GREY, ES2)
    assert "channel" not in package.read_text(package.manifest.level_programs[0].fragment).split("main")[1]
    assert "weights" not in package.read_text(package.manifest.level_programs[0].fragment)


def test_the_loop_of_es_2_is_long_enough_for_the_longest_ray_at_the_finest_step(tmp_path):
    package = tiny_package(
        tmp_path / "p", np.zeros((5, 4, 3), np.uint8), GREY, ES2, spacing_mm_zyx=(10.0, 1.0, 1.0), step_mm=0.8
    )
    program = package.manifest.level_programs[0]
    assert program.step_mm_min == pytest.approx(0.1)
    bound = re.search(r"for \(float k = 0\.0; k < ([\d.]+); k\+\+\)", package.read_text(program.fragment))
    assert bound is not None
    assert float(bound[1]) >= np.linalg.norm([50.0, 4.0, 3.0]) / program.step_mm_min


def test_the_loop_of_es_3_ends_where_float32_ends_to_count(tmp_path):
    package = tiny_package(tmp_path / "p", np.zeros((5, 4, 3), np.uint8), GREY, ES3)
    assert package.manifest.level_programs[0].step_mm_min == pytest.approx(np.linalg.norm([5, 4, 3]) / 2**23)


def test_a_constant_that_no_part_uses_is_an_error():
    with pytest.raises(VolprepError, match=r"VP9001 .*\['UNUSED'\]"):
        compose("vertex/picture", "es300", {"place_declared": None, "place": None}, {"UNUSED": "1.0"})


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((1,), "1.0"),
        ((0.1,), "0.1"),
        ((1 / 3,), "0.33333334"),
        ((1e-12,), "1e-12"),
        ((16777216.0,), "1.6777216e+07"),
        ((1, 2), "vec2(1.0, 2.0)"),
        ((0.5, 2e20, 3), "vec3(0.5, 2e+20, 3.0)"),
    ],
)
def test_literals_are_the_shortest_text_of_the_float32(values, text):
    assert literal(*values) == text


def test_the_same_plan_gives_the_same_text(tmp_path):
    codes = np.zeros((5, 4, 3), np.uint8)
    one, other = (texts(tiny_package(tmp_path / name, codes, GREY, ES2, packing=Packing(4))) for name in "ab")
    assert one == other
