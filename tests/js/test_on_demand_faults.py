"""What a page does while bricks are late, lost or few, while the camera moves, and for picks, slices and cuts."""

import base64

import numpy as np
import pytest
from brick_scene import ON_DEMAND, PIXELS, TRANSFER, drawn, voxels
from browser import PageError
from scene_builds import built, view_of, write_raw_scene
from web_pictures import TWO_STEPS, rmse
from web_server import WebServer

from volprep.render.on_demand.bricks import BrickFile
from volprep.render.on_demand.choice import in_order
from volprep.render.on_demand.rays import view_loss
from volprep_formats.package.reader import Package


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    return built(write_raw_scene(tmp_path_factory.mktemp("on-demand"), voxels(), TRANSFER + ON_DEMAND))


@pytest.fixture(scope="module")
def view(package) -> np.ndarray:
    return view_of(package.manifest.grid, "anterior-left")


@pytest.fixture(scope="module")
def address(server, package) -> str:
    server.folders["faults"] = package.path.parent
    return f"/faults/{package.path.name}"


@pytest.fixture(scope="module")
def whole(browser, server, address, view) -> dict:
    """The page at rest with all bricks."""
    (found,) = drawn(browser, server, address, [view])["found"]
    return found


def decoded(picture: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(picture), "<f4").reshape(PIXELS, PIXELS, 4)


def test_a_brick_that_the_server_does_not_send_is_named_and_comes_later(browser, server, address, view, whole) -> None:
    bricks = BrickFile.of(Package.open(server.folders["faults"] / address.rsplit("/", 1)[1]))
    order = in_order(bricks, view_loss(bricks, view, (PIXELS, PIXELS)).gains(bricks))
    lost = next(int(bricks.begins[0][place]) for level, place in order if level == 0)
    server.asked.clear()
    server.refused = lambda path, sent: (
        path.endswith("bricks.bin") and lost in sent and not any("healed" in asked for asked in server.asked)
    )
    then = """
await fetch("/healed");
const real = performance.now.bind(performance);
performance.now = () => real() + 11000;
said = await rest(given[1][0]);
"""
    try:
        found = drawn(browser, server, address, [view], then)
    finally:
        server.refused = None
    (problem,) = found["failed"]
    assert "bricks.bin" in problem
    (first,) = found["found"]
    assert first["damaged"] == 1
    assert first["bound"] > 0.0
    assert 0.0 < rmse(first["picture"], whole["picture"]) < first["bound"]
    assert found["said"]["damaged"] == 0
    assert found["said"]["bound"] == pytest.approx(whole["bound"], abs=1e-6)


def test_on_a_slow_network_the_bound_falls_while_pictures_become_nearer(browser, package, server, view, whole) -> None:
    folders = {**server.folders, "slow": package.path.parent}
    with WebServer(folders, latency_s=0.2, latency_only="bricks.bin", bytes_per_second=200_000) as slow:
        (found,) = drawn(browser, slow, f"/slow/{package.path.name}", [view])["found"]
    assert len(set(found["bounds"])) > 3
    assert found["bounds"] == sorted(found["bounds"], reverse=True)
    assert rmse(found["picture"], whole["picture"]) < TWO_STEPS


def test_after_a_lost_context_bricks_come_again(browser, server, address, view, whole) -> None:
    then = """
const lose = gl.getExtension("WEBGL_lose_context");
const before = bricks.state.fetchedBytes;
lose.loseContext();
await wait(200);
lose.restoreContext();
await wait(600);
said = { ...(await rest(given[1][0])), before };
"""
    found = drawn(browser, server, address, [view], then)
    assert found["failed"] == []
    assert found["said"]["fetchedBytes"] == 2 * found["said"]["before"]
    assert found["said"]["bound"] == pytest.approx(whole["bound"], abs=1e-6)


def test_while_the_camera_moves_bricks_of_where_it_goes_are_fetched(browser, server, package, address, view) -> None:
    then = """
let moving = 0;
for (let i = 1; i <= 20; i++) {
  const t = i / 20;
  renderer.draw({ boxFromClip: given[1][0].map((each, k) => each * (1 - t) + given[3][k] * t) });
  await wait(50);
  moving = bricks.state.fetchedBytes;
}
said = { moving, ...(await rest(given[3])) };
""".replace("given[3]", "given[2].end")
    end = view_of(package.manifest.grid, "left").T.ravel().tolist()
    # The memory holds what one view wants, so that the next one needs others.
    found = drawn(browser, server, address, [view], then, memoryBytes=30_000, end=end)
    begun = found["found"][0]["fetchedBytes"]
    assert found["failed"] == []
    assert found["said"]["missing"] == 0
    assert found["said"]["moving"] > begun
    assert found["said"]["fetchedBytes"] >= found["said"]["moving"]


def test_points_and_slices_are_read_from_the_finest_bricks(browser, server, address, view, whole) -> None:
    read = """
const at = [40, 30];
const first = bricks.state.bricks;
const hit = await renderer.pick(...at);
const picked = bricks.state.bricks;
const slice = await renderer.slice({ plane: "axial", at: 0.4, size: 64 });
said = { value: hit.value, depth: hit.depth_mm, first, picked, values: [...slice.values].map((each) => each || 0) };
"""
    every = drawn(browser, server, address, [view], read)["said"]
    few = drawn(browser, server, address, [view], read, target=1)["said"]
    assert few["first"] < few["picked"] < every["first"]
    assert few["value"] == pytest.approx(every["value"], abs=1e-3)
    assert few["depth"] == pytest.approx(every["depth"], abs=1e-3)
    np.testing.assert_allclose(few["values"], every["values"], atol=1e-3)


def test_a_cut_keeps_the_bricks_and_shows_those_behind_it(browser, server, address, view) -> None:
    then = """
const before = bricks.state.fetchedBytes;
await renderer.setClip({ box: [[0, 0, 0], [22, 40, 40]] });
const kept = bricks.state.bricks;
said = { before, kept, ...(await rest(given[1][0])) };
"""
    every = drawn(browser, server, address, [view], then)
    few = every["said"]
    assert few["kept"] == every["found"][0]["bricks"]
    assert few["missing"] == 0
    some = drawn(browser, server, address, [view], then, memoryBytes=20_000)
    assert some["failed"] == []
    assert some["said"]["bricks"] <= 20
    error = rmse(decoded(some["said"]["picture"]), decoded(few["picture"]))
    assert 0.0 < error < some["said"]["bound"]
    # What is cut away needs no bricks.
    assert some["said"]["bound"] < 0.9 * some["found"][0]["bound"]


def test_without_memory_for_the_pool_the_levels_are_drawn(browser, server, address) -> None:
    script = """
const { openPackage } = await import("/js/volpkg.js");
const { createOnDemand } = await import("/js/on_demand.js");
const gl = new OffscreenCanvas(64, 64).getContext("webgl2");
const pack = await openPackage(given[0]);
const failed = [];
const onError = (error) => failed.push(error.message);
const renderer = await createOnDemand(gl, pack, { maxTextureBytes: 20000, onError });
await new Promise((resolve) => setTimeout(resolve, 500));
return { failed, level: renderer.level, drawn: renderer.draw({ boxFromClip: given[1] }) };
"""
    browser.open(f"{server.url}/")
    found = browser.run(script, address, np.eye(4).ravel().tolist())
    (problem,) = found["failed"]
    assert problem.startswith("VP7013 the textures of level 0 take")
    assert found["level"] == 2
    assert found["drawn"]


def test_webgl_1_is_refused_by_name(browser, server, address) -> None:
    script = """
const { openPackage } = await import("/js/volpkg.js");
const { createOnDemand } = await import("/js/on_demand.js");
return createOnDemand(new OffscreenCanvas(64, 64).getContext("webgl"), await openPackage(given[0]));
"""
    browser.open(f"{server.url}/")
    with pytest.raises(PageError, match="WebGL 2"):
        browser.run(script, address)
