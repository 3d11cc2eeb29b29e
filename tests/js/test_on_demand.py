"""A page draws from bricks on demand: the same ones as the reference chooses, few requests, and damage is named."""

import numpy as np
import pytest
from brick_scene import ON_DEMAND, PIXELS, TRANSFER, drawn, voxels
from command_line import ended
from scene_builds import built, view_of, write_raw_scene
from web_pictures import TWO_STEPS, rmse
from web_server import WebServer

from volprep.render.on_demand.bricks import BrickFile
from volprep.render.on_demand.choice import choose, in_order
from volprep.render.on_demand.inputs import edit_of
from volprep.render.on_demand.rays import view_loss
from volprep.render.renderer import Renderer
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import names_in
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Silent


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    return built(write_raw_scene(tmp_path_factory.mktemp("on-demand"), voxels(), TRANSFER + ON_DEMAND))


def of_reference(package: Package, matrix: np.ndarray, places: int):
    """Return the picture and the choice of the reference renderer."""
    bricks = BrickFile.of(package)
    chosen = choose(bricks, view_loss(bricks, matrix, (PIXELS, PIXELS)), places, 0.0)
    with Renderer(package, target="rgba32f", edit=edit_of(bricks, chosen.held, None)) as renderer:
        return renderer.render(matrix, (PIXELS, PIXELS)), chosen


def test_a_page_chooses_and_draws_the_bricks_of_the_reference(browser, server, package) -> None:
    server.folders["package"] = package.path.parent
    matrices = [view_of(package.manifest.grid, view) for view in ("anterior-left", "superior")]
    server.asked.clear()
    said = drawn(browser, server, f"/package/{package.path.name}", matrices)
    assert said["failed"] == []
    for found, matrix in zip(said["found"], matrices, strict=True):
        picture, chosen = of_reference(package, matrix, 10**6)
        assert picture[..., 3].max() > 0.3
        assert rmse(found["picture"], picture) < TWO_STEPS
        assert found["missing"] == 0
        assert found["bound"] == pytest.approx(chosen.bound, abs=1e-6)
        assert found["bounds"] == sorted(found["bounds"], reverse=True)
        assert found["error"] == 0
    ranges = [each for each in server.asked if "bricks.bin" in each]
    assert all("bytes=" in each for each in ranges)
    assert 1 <= len(ranges) <= 8


@pytest.mark.parametrize("places", [12, 24, 48])
def test_a_page_with_less_memory_states_the_bound_of_the_reference(browser, server, package, places) -> None:
    server.folders["package"] = package.path.parent
    matrices = [view_of(package.manifest.grid, view) for view in ("left", "anterior-left")]
    said = drawn(browser, server, f"/package/{package.path.name}", matrices, memoryBytes=1000 * places)
    for found, matrix in zip(said["found"], matrices, strict=True):
        picture, chosen = of_reference(package, matrix, places)
        assert found["bricks"] <= places
        assert found["missing"] == 0
        # Bricks of the view before may stay where the new one leaves room.
        assert found["bound"] == pytest.approx(chosen.bound, rel=2e-3)
        assert rmse(found["picture"], picture) < TWO_STEPS


def test_bricks_come_from_one_file_and_from_a_server_without_ranges(browser, package, server, tmp_path) -> None:
    with (tmp_path / "p.volpkg.zip").open("wb") as stream:
        write_single_file(package.path, names_in(package.path), stream, Silent())
    matrix = view_of(package.manifest.grid, "anterior")
    picture, chosen = of_reference(package, matrix, 10**6)
    for ranges in (True, False):
        with WebServer({**server.folders, "zip": tmp_path, "package": package.path.parent}, ranges=ranges) as other:
            for address in ("/zip/p.volpkg.zip", f"/package/{package.path.name}"):
                said = drawn(browser, other, address, [matrix])
                assert said["failed"] == []
                assert said["found"][0]["bound"] == pytest.approx(chosen.bound, abs=1e-6)
                assert rmse(said["found"][0]["picture"], picture) < TWO_STEPS


def test_a_damaged_brick_is_named_and_the_others_are_drawn(browser, server, package, tmp_path) -> None:
    target = tmp_path / "damaged.volpkg"
    ended(["cp", "-r", package.path, target])
    file = target / package.manifest.on_demand.bricks
    data = bytearray(file.read_bytes())
    matrix = view_of(package.manifest.grid, "anterior")
    bricks = BrickFile.of(package)
    last = next(
        each for each in in_order(bricks, view_loss(bricks, matrix, (PIXELS, PIXELS)).gains(bricks)) if each[0] == 0
    )
    data[int(bricks.begins[0][last[1]]) + 9] ^= 0x40
    file.write_bytes(data)
    server.folders["broken"] = tmp_path
    said = drawn(browser, server, "/broken/damaged.volpkg", [matrix])
    (problem,) = said["failed"]
    assert problem.startswith("VP5043")
    z, y, x = last[1]
    assert f"the brick x {x}, y {y}, z {z} of level 0" in problem
    (found,) = said["found"]
    assert found["damaged"] == 1
    assert found["missing"] == 0
    assert found["bound"] > 0.0
    assert rmse(found["picture"], of_reference(package, matrix, 10**6)[0]) < found["bound"]
