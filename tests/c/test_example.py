"""The example draws what `volprep render` draws, from every kind of package."""

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from every_kind import single_file
from looked import look_table
from scene_builds import built
from slice_packages import missing_es11, slice_package
from tamper_scenes import write_kind

from volprep.pipeline.shot import Shot, take
from volprep.render.hybrid import HybridWish
from volprep.render.inputs import Inputs
from volprep.render.renderer import Renderer
from volprep.truth.camera import STANDARD_VIEWS, standard_views
from volprep.truth.picture import encoded
from volprep_formats.package.parts.segments.record import looks
from volprep_formats.package.parts.segments.texels import look_texels
from volprep_formats.package.reader import Package

from .conftest import EXAMPLE, told

SIDE = 72
DRAWS = {
    "slabs": 'technique = "slabs"',
    "slabs at meshes": 'technique = "slabs"\n[proxy]\nblock = 4',
    "two-pass": 'technique = "two-pass"',
    "axis-slices": 'technique = "axis-slices"',
    "view-slices": 'technique = "view-slices"\nprojection = "perspective"',
}
"""Settings of pictures that take several draws, beside the ones with shadows."""
SMALL_SLICES = """
name = "small"
api = "es1.1"
max_texture_size = 64
max_3d_texture_size = 0
texture_units = 2
texture_formats = ["rgba8unorm", "palette8-rgba8unorm"]
npot = false
index_bits = 16
max_texture_bytes = 6000
"""


def pixels(path: Path) -> np.ndarray:
    picture = OpenImageIO.ImageInput.open(str(path))
    found = np.asarray(picture.read_image("uint8"), int)
    picture.close()
    return found


@pytest.fixture(scope="module")
def drawn(example_program, tmp_path_factory):
    """Draw a package with the example and with the renderer; give both pictures, and what the renderer drew with."""
    folder = tmp_path_factory.mktemp("drawn")
    environment = os.environ | {"EGL_PLATFORM": "surfaceless", "GALLIVM_PERF": "no_aos_sampling"}

    def draw(package: Path, view: str, **chosen: int | str) -> tuple[np.ndarray, np.ndarray, str]:
        words = ["--view", view, "--size", str(SIDE)]
        words += [word for name, value in chosen.items() for word in (f"--{name}", str(value))]
        command = [example_program, package, folder / "example.png", *words]
        subprocess.run(command, check=True, env=environment)
        numbers = {name: chosen.get(name) for name in ("level", "point", "transfer")}
        plain = HybridWish(lines=False) if Package.open(package).manifest.render.hybrid else None
        shot = Shot(
            hybrid=plain, view=view, eye_mm_xyz=None, shape_hw=(SIDE, SIDE), background="black", step_mm=None, **numbers
        )
        taken = take(package, shot, folder / "renderer.png")
        return pixels(folder / "example.png"), pixels(folder / "renderer.png"), taken.drawn_by

    return draw


def assert_agree(found: np.ndarray, expected: np.ndarray, name: str) -> None:
    assert expected.max() > 60, f"{name} is dark"
    assert np.abs(found - expected).max() == 0, name


@pytest.mark.long
def test_every_kind_of_package_looks_as_the_renderer_draws_it(drawn, packages):
    programs = set()
    for kind, package in packages.items():
        if kind != "slices" or missing_es11() is None:
            found, expected, drawn_by = drawn(package, "anterior-left")
            assert_agree(found, expected, kind)
            programs.add(drawn_by)
    assert any("proxy" in name for name in programs)


def test_each_level_and_transfer_function_looks_as_the_renderer_draws_it(drawn, packages):
    for kind, chosen in (("mipmaps", {"level": 1}), ("several-units", {"transfer": "core"}), ("house", {"level": 1})):
        found, expected, _ = drawn(packages[kind], "superior", **chosen)
        assert_agree(found, expected, kind)


def test_sub_volumes_around_a_point_look_as_the_renderer_draws_them(drawn, packages):
    found, expected, _ = drawn(packages["house"], "posterior", point=17)
    assert_agree(found, expected, "point 17")


@pytest.mark.long(keep=1)
@pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")
@pytest.mark.parametrize(
    ("spacing_mm_zyx", "settings"),
    [
        ((2.5, 0.75, 1.0), {"head": "editable = true"}),
        ((1.0, 1.0, 1.0), {"slices": 'form = "rgba"', "projection": "perspective"}),
        # A level whose last slices lie beyond the volume, in several textures for each stack.
        ((1.5, 1.0, 1.0), {"profile": "small.toml", "extra": "[pyramid]\ncoarsest_longest_axis = 8"}),
    ],
    ids=["palettes", "rgba", "coarse"],
)
def test_slices_look_as_the_renderer_draws_them(spacing_mm_zyx, settings, drawn, tmp_path: Path):
    (tmp_path / "small.toml").write_text(SMALL_SLICES)
    codes = np.random.default_rng(3).integers(0, 256, (11, 18, 37))
    package = slice_package(tmp_path, codes, spacing_mm_zyx, **settings)
    for view in STANDARD_VIEWS:
        found, expected, _ = drawn(single_file(package.path), view)
        assert_agree(found, expected, view)


def test_slices_that_are_not_there_are_refused_with_what_there_is(example_program, packages, tmp_path: Path):
    for word, value, said in (
        ("level", "9", "no slices of its level 9, but of its level 0"),
        ("transfer", "other", "there are slices of shell"),
    ):
        status, text = told(example_program, packages["slices"], tmp_path / "p.png", f"--{word}", value)
        assert status == 1
        assert "VP5018" in text
        assert said in text
    assert not (tmp_path / "p.png").exists()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", DRAWS)
def test_pictures_of_several_draws_look_as_the_renderer_draws_them(name, drawn, tmp_path: Path):
    scene = write_kind(tmp_path, "plain")
    scene.write_text(f"{scene.read_text()}\n[render]\n{DRAWS[name]}\n")
    built(scene, tmp_path / "p.volpkg")
    found, expected, _ = drawn(single_file(tmp_path / "p.volpkg"), "posterior-left")
    assert_agree(found, expected, name)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("view", ["posterior", "superior"])
def test_half_angle_slices_agree_from_before_and_behind_the_light(view, drawn, packages):
    found, expected, _ = drawn(packages["half-angle"], view)
    assert_agree(found, expected, view)


def test_a_hidden_segment_is_not_drawn(drawn, packages):
    def hidden(package: Package, inputs: Inputs) -> Inputs:
        segments = package.manifest.segments
        first = segments.segments[0].model_copy(update={"visible": False})
        changed = segments.model_copy(update={"segments": (first, *segments.segments[1:])})
        table = look_table(package)
        return replace(inputs, texels={table.name: look_texels(looks(changed), table.format)})

    package = Package.open(packages["segments"])
    found, shown, _ = drawn(packages["segments"], "anterior", hide=package.manifest.segments.segments[0].name)
    grid = package.manifest.levels[0].grid
    with Renderer(package, edit=hidden) as renderer:
        camera = standard_views(grid, package.manifest.render.projection)["anterior"]
        expected = encoded(renderer.render(camera.box_from_clip(grid, 1.0), (SIDE, SIDE)), "black")
    assert_agree(found, expected.astype(int), "hidden")
    assert (found != shown).any()


def test_a_level_that_no_program_draws_is_refused_with_what_there_is(example_program, packages, tmp_path: Path):
    for word, value, said in (
        ("level", "9", "its levels 0, 1, 2"),
        ("transfer", "other", "there are programs for shell"),
    ):
        status, text = told(example_program, packages["house"], tmp_path / "p.png", f"--{word}", value)
        assert status == 1
        assert "VP5018" in text
        assert said in text


def test_the_example_has_at_most_300_lines():
    assert len(EXAMPLE.read_text().splitlines()) <= 300
