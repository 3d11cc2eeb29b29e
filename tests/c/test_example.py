"""The example draws what `volprep render` draws, from every kind of package that has shaders."""

import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from every_kind import single_file
from phantom_scene import write_phantom_scene

from volprep.pipeline.build import build
from volprep.pipeline.shot import Shot, take
from volprep.render.hybrid import HybridWish
from volprep.scene.request import load_request
from volprep_formats.progress import Silent

from .conftest import EXAMPLE, told

SIDE = 72
ONE_STEP = 1
"""Of 255: what the two may differ by."""


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
        plain = HybridWish(lines=False)
        shot = Shot(
            hybrid=plain, view=view, eye_mm_xyz=None, shape_hw=(SIDE, SIDE), background="black", step_mm=None, **numbers
        )
        taken = take(package, shot, folder / "renderer.png")
        return pixels(folder / "example.png"), pixels(folder / "renderer.png"), taken.drawn_by

    return draw


def assert_agree(found: np.ndarray, expected: np.ndarray, name: str) -> None:
    assert expected.max() > 60, f"{name} is dark"
    assert np.abs(found - expected).max() <= ONE_STEP, name


def test_every_kind_of_package_with_shaders_looks_as_the_renderer_draws_it(drawn, packages):
    programs = set()
    for kind, package in packages.items():
        if kind != "slices":
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


def test_slices_are_refused_with_a_code(example_program, packages, tmp_path: Path):
    status, text = told(example_program, packages["slices"], tmp_path / "p.png")
    assert status == 1
    assert "VP5018" in text
    assert "OpenGL ES 1.1" in text
    assert not (tmp_path / "p.png").exists()


def test_a_picture_of_several_draws_is_refused_with_a_code(example_program, tmp_path: Path):
    scene = write_phantom_scene(tmp_path, "gles3")
    light = '[lighting]\nlight_mm = [200.0, -300.0, 400.0]\nnormals = "central"\nshadows = "half-angle"\n'
    scene.write_text(f'{scene.read_text()}\n[render]\ntechnique = "view-slices"\nlighting = "phong"\n{light}')
    build(load_request(scene), tmp_path / "p.volpkg", Silent())
    status, text = told(example_program, single_file(tmp_path / "p.volpkg"), tmp_path / "p.png")
    assert status == 1
    assert "VP5018" in text
    assert "several draws" in text


def test_the_example_has_at_most_300_lines():
    assert len(EXAMPLE.read_text().splitlines()) <= 300
