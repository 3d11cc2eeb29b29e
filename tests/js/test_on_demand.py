"""A page draws from bricks on demand: the same ones as the reference chooses, few requests, and damage is named."""

import base64

import numpy as np
import pytest
from browser import Browser
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

PIXELS = 64
TABLES = """
[pyramid]
filter = "box"
coarsest_longest_axis = 20
[[transfer]]
name = "skin"
points = [
    { value = 40.0, colour = "#c07050", extinction_per_mm = 0.0 },
    { value = 120.0, colour = "#ffc0a0", extinction_per_mm = 0.1 },
    { value = 220.0, colour = "#4060ff", extinction_per_mm = 0.6 },
]
[on_demand]
size = 8
"""
DRAW = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const { drawOnDemand } = await import("/js/on_demand.js");
const { toBase64 } = await import("/support/page.mjs");
const gl = new OffscreenCanvas(64, 64).getContext("webgl2");
const pack = await openPackage(given[0]);
const renderer = await createRenderer(gl, pack, { level: 2 });
const failed = [];
const bricks = await drawOnDemand(renderer, { target: 0, onError: (error) => failed.push(error.message), ...given[2] });
const rest = async (boxFromClip) => {
  renderer.draw({ boxFromClip });
  const seen = [];
  for (let still = 0; still < 4; ) {
    await new Promise((resolve) => setTimeout(resolve, 100));
    const now = JSON.stringify(bricks.state);
    if (now === seen[seen.length - 1]) still++;
    else [still] = [0, seen.push(now)];
    renderer.draw({ boxFromClip });
  }
  return { ...bricks.state, bounds: seen.map((each) => JSON.parse(each).bound),
    picture: toBase64(renderer.readPixels().pixels), error: gl.getError() };
};
const found = [];
for (const matrix of given[1]) found.push(await rest(matrix));
bricks.dispose();
renderer.dispose();
pack.close();
return { found, failed };
"""


def voxels(dtype=np.uint8):
    """Return blobs and noise, with empty corners."""
    rng = np.random.default_rng(5)
    z, y, x = np.meshgrid(*(np.arange(n) for n in (37, 30, 43)), indexing="ij")
    volume = np.zeros((37, 30, 43))
    for centre, radius, value in (((12, 10, 12), 8, 150), ((26, 20, 30), 7, 220)):
        inside = sum((a - c) ** 2 for a, c in zip((z, y, x), centre, strict=True)) < radius**2
        volume[inside] = value + 30 * rng.standard_normal(volume.shape)[inside]
    volume[18, 4:28, 21] = 250
    return np.clip(volume, 0, 255).astype(dtype)


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    return built(write_raw_scene(tmp_path_factory.mktemp("on-demand"), voxels(), TABLES))


def run(browser: Browser, server: WebServer, address: str, matrices: list[np.ndarray], **options: object) -> dict:
    browser.open(f"{server.url}/")
    found = browser.run(DRAW, address, [matrix.T.ravel().tolist() for matrix in matrices], options, timeout=60)
    for each in found["found"]:
        each["picture"] = np.frombuffer(base64.b64decode(each["picture"]), "<f4").reshape(PIXELS, PIXELS, 4)
    return found


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
    said = run(browser, server, f"/package/{package.path.name}", matrices)
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
    said = run(browser, server, f"/package/{package.path.name}", matrices, memoryBytes=1000 * places)
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
                said = run(browser, other, address, [matrix])
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
    said = run(browser, server, "/broken/damaged.volpkg", [matrix])
    (problem,) = said["failed"]
    assert problem.startswith("VP5043")
    z, y, x = last[1]
    assert f"the brick x {x}, y {y}, z {z} of level 0" in problem
    (found,) = said["found"]
    assert found["damaged"] == 1
    assert found["missing"] == 0
    assert found["bound"] > 0.0
    assert rmse(found["picture"], of_reference(package, matrix, 10**6)[0]) < found["bound"]
