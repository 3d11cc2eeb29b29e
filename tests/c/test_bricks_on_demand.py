"""The header chooses, fetches and replaces bricks as the reference does, and names those that it cannot have."""

import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from brick_scene import ON_DEMAND, TRANSFER, voxels
from compiled_c import compiled
from scene_builds import built, write_raw_scene

from volprep.render.on_demand.bricks import BrickFile
from volprep.render.on_demand.choice import choose
from volprep.render.on_demand.inputs import edit_of
from volprep.render.on_demand.rays import view_loss
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.picture import encoded
from volprep_formats.package.reader import Package

SIDE = 72
VIEW = "anterior-left"
LIT = '[render]\nlighting = "headlight"\n[lighting]\nnormals = "central"\n'


@pytest.fixture(scope="module")
def program(tmp_path_factory, example_program) -> Path:
    """Draws from bricks; `example_program` says whether it can be compiled here."""
    source = Path(__file__).with_name("draw_bricks.c")
    libraries = ("-lEGL", "-lGLESv1_CM", "-lGLESv2", "-l:libzstd.so.1")
    return compiled(tmp_path_factory.mktemp("bricks") / "draw_bricks", source, *libraries)


@pytest.fixture(scope="module", params=["", LIT], ids=["unlit", "lit"])
def package(request, tmp_path_factory) -> Package:
    folder = tmp_path_factory.mktemp("on-demand")
    return built(write_raw_scene(folder, voxels(), TRANSFER + ON_DEMAND + request.param))


def drawn(program: Path, package: Package, folder: Path, memory: int, broken: int = -1) -> tuple[np.ndarray, list[str]]:
    """Return the picture and the printed lines."""
    mesa = {"EGL_PLATFORM": "surfaceless", "GALLIVM_PERF": "no_aos_sampling"}
    command = [program, package.path, folder / "c.png", VIEW, SIDE, memory, broken]
    said = subprocess.run(list(map(str, command)), env=os.environ | mesa, check=True, capture_output=True, text=True)
    picture = OpenImageIO.ImageInput.open(str(folder / "c.png"))
    found = np.asarray(picture.read_image("uint8"), int)[..., :3]
    picture.close()
    return found, said.stdout.splitlines()


@pytest.mark.parametrize("places", [12, 30, 1000])
def test_the_header_draws_the_bricks_of_the_reference(program, package, tmp_path, places) -> None:
    bricks = BrickFile.of(package)
    matrix = standard_views(bricks.grid, package.manifest.render.projection)[VIEW].box_from_clip(bricks.grid, 1.0)
    chosen = choose(bricks, view_loss(bricks, matrix, (SIDE, SIDE)), places, 0.0)
    with Renderer(package, edit=edit_of(bricks, chosen.held, None)) as renderer:
        expected = encoded(renderer.render(matrix, (SIDE, SIDE)), "black").astype(int)
    found, (line,) = drawn(program, package, tmp_path, places * package.manifest.on_demand.brick_bytes)
    bound, count, fetched = line.split()
    assert expected.max() > 60
    assert abs(found - expected).max() <= 2
    assert float(bound) == pytest.approx(chosen.bound, rel=1e-4, abs=1e-6)
    assert int(count) == chosen.bricks - int(bricks.stored[-1].sum())
    assert int(fetched) >= chosen.bricks


def test_a_brick_that_cannot_be_had_is_named_and_drawn_from_the_next_level(program, package, tmp_path) -> None:
    bricks = BrickFile.of(package)
    whole, (line,) = drawn(program, package, tmp_path, 10**8)
    z, y, x = np.unravel_index(np.argmax(bricks.records[0]["loss"][..., 0]), bricks.records[0].shape)
    found, (problem, other) = drawn(program, package, tmp_path, 10**8, int(bricks.begins[0][z, y, x]))
    assert problem.startswith("VP5043")
    assert f"the brick x {x}, y {y}, z {z} of level 0: it cannot be had" in problem
    assert float(line.split()[0]) < float(other.split()[0])
    assert 2 < abs(found - whole).max() < 250
