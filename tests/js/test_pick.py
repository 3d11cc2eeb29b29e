"""Picking: the first point of a pixel's ray at which an opacity is reached, as the oracle finds it."""

import numpy as np
import pytest
from phantom_scene import seen_phantom
from scipy.ndimage import map_coordinates
from web_pictures import box_from_clip_of

from volprep.truth.decoded import level_volume
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.reader import Package

SIZE = 32
PIXELS = [(x + 0.5, y + 0.5) for x in (9, 15) for y in (11, 16)]
VIEWS = [0, 6, 8]
SCRIPT = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const [url, matrices, pixels, opacity, kind] = given;
const gl = new OffscreenCanvas(32, 32).getContext(kind);
const renderer = await createRenderer(gl, await openPackage(url));
await renderer.ready;
const hits = [];
for (const boxFromClip of matrices) {
  renderer.draw({ boxFromClip });
  for (const [x, y] of pixels) hits.push(await renderer.pick(x, y, { opacity }));
}
const { step } = renderer;
const error = gl.getError();
renderer.dispose();
return { hits, step, error };
"""


def ends_of(matrix: np.ndarray, x: float, y: float) -> np.ndarray:
    """Ends of a pixel's ray, box millimetres."""
    clip = np.array([[2 * x / SIZE - 1, 1 - 2 * y / SIZE, depth, 1.0] for depth in (-1.0, 1.0)])
    box = clip @ matrix.T
    return box[:, :3] / box[:, 3:]


def first_hit(
    package: Package, volume: np.ndarray, matrix: np.ndarray, pixel: tuple[float, float], opacity: float
) -> float | None:
    """Distance in millimetres along a pixel's ray at which the oracle's opacity is reached; None if it is not."""
    manifest, (x, y) = package.manifest, pixel
    function = manifest.transfer_functions[0]
    near, far = ends_of(matrix, x, y)
    length = float(np.linalg.norm(far - near))

    def alpha(share: float) -> float:
        end = near + share * (far - near)
        ray = np.eye(4)
        ray[:3, 2], ray[:3, 3] = (end - near) / 2, (end + near) / 2
        ray[:3, 0], ray[:3, 1] = np.linalg.svd((far - near)[None])[2][1:] * 1e-9
        return float(oracle_picture(Volume(volume, manifest.grid), function, ray, (1, 1), 1e-5).rgba[0, 0, 3])

    low, high = 0.0, 1.0
    if alpha(high) < opacity:
        return None
    for _ in range(14):
        middle = (low + high) / 2
        low, high = (low, middle) if alpha(middle) >= opacity else (middle, high)
    return length * (low + high) / 2


def value_at(package: Package, volume: np.ndarray, box_mm: np.ndarray) -> float:
    at = box_mm[::-1] / package.manifest.grid.spacing_mm_zyx - 0.5
    return float(map_coordinates(volume.astype(float), at[:, None], order=1, mode="nearest")[0])


@pytest.fixture
def pick(browser, server):
    def run(package: Package, opacity: float, kind: str = "webgl2") -> dict:
        server.folders["package"] = package.path.parent
        if not browser.run("return location.href").startswith(server.url):
            browser.open(f"{server.url}/")
        matrices = [box_from_clip_of(package)[view].T.ravel().tolist() for view in VIEWS]
        return browser.run(SCRIPT, "/package/p.volpkg", matrices, PIXELS, opacity, kind)

    return run


@pytest.mark.parametrize("opacity", [0.1, 0.5])
def test_a_pick_is_the_first_hit_of_the_oracle_within_half_a_step(pick, scene_package, opacity) -> None:
    package = scene_package("half floats")
    found = pick(package, opacity)
    grid = package.manifest.grid
    volume = np.ascontiguousarray(seen_phantom(package.manifest))
    assert found["error"] == 0
    compared = 0
    for n, hit in enumerate(found["hits"]):
        matrix, (x, y) = box_from_clip_of(package)[VIEWS[n // len(PIXELS)]], PIXELS[n % len(PIXELS)]
        wanted = first_hit(package, volume, matrix, (x, y), opacity)
        assert (hit is None) == (wanted is None), (n, wanted)
        if hit is None or wanted is None:
            continue
        compared += 1
        near, far = ends_of(matrix, x, y)
        box = np.array(hit["box_mm"])
        assert abs(np.linalg.norm(box - near) - wanted) <= hit["uncertainty_mm"] == found["step"] / 2
        # It lies on the ray of the pixel, and all its places are one.
        away = box - near - (far - near) * np.dot(box - near, far - near) / np.dot(far - near, far - near)
        assert np.linalg.norm(away) < 1e-3
        spacing_xyz = np.array(grid.spacing_mm_zyx[::-1])
        assert np.allclose((np.array(hit["voxel"]) + 0.5) * spacing_xyz, box)
        place = grid.corner_mm_xyz + np.array(grid.direction) @ box
        assert np.allclose(hit["position_mm"], place, atol=1e-6)
        assert abs(hit["value"] - value_at(package, volume, box)) < 3.0
        normal = np.array(grid.direction).T @ np.array(hit["normal"])
        assert np.dot(normal, far - near) <= 0
        slope = [
            value_at(package, volume, box + side) - value_at(package, volume, box - side)
            for side in np.diag(spacing_xyz)
        ]
        slope = np.array(slope) / spacing_xyz
        assert abs(np.dot(slope / np.linalg.norm(slope), normal)) > 0.99
    assert compared > 4


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", ["lit mosaic, skips by distance", "bricks", "two passes", "slices across the view"])
def test_every_technique_and_texture_is_picked_alike(pick, scene_package, name) -> None:
    package = scene_package(name)
    # Codes of 8 bits are the package's own error: where the function is flat they move single points by two steps.
    decoded = level_volume(package, 0)
    volume = np.ascontiguousarray(decoded.slope * decoded.stored + decoded.intercept, np.float32)
    found = pick(package, 0.3)
    assert found["error"] == 0
    apart = []
    for n, hit in enumerate(found["hits"]):
        matrix, (x, y) = box_from_clip_of(package)[VIEWS[n // len(PIXELS)]], PIXELS[n % len(PIXELS)]
        wanted = first_hit(package, volume, matrix, (x, y), 0.3)
        if hit is None or wanted is None:
            continue
        box = np.array(hit["box_mm"])
        apart.append(abs(np.linalg.norm(box - ends_of(matrix, x, y)[0]) - wanted) / hit["uncertainty_mm"])
        assert abs(hit["value"] - value_at(package, volume, box)) < 0.01
    assert len(apart) > 4
    # A quarter of a step: rays end exactly where they are to end.
    assert np.max(apart) <= 0.5


def test_a_pick_on_an_isosurface_has_its_value(pick, scene_package) -> None:
    hits = [each for each in pick(scene_package("isosurface"), 0.3)["hits"] if each]
    assert len(hits) > 3
    assert all(abs(each["value"] - 800) < 8 for each in hits)


def test_the_fidelity_of_a_picture_says_where_its_numbers_come_from(browser, server, scene_package) -> None:
    package = scene_package("half floats")
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    script = """
    const { openPackage, createRenderer } = await import("/js/volpkg.js");
    const gl = new OffscreenCanvas(24, 24).getContext("webgl2");
    const pack = await openPackage("/package/p.volpkg");
    const renderer = await createRenderer(gl, pack);
    await renderer.ready;
    const found = [await renderer.fidelity()];
    const draw = () => renderer.draw({ boxFromClip: given[0] });
    draw();
    found.push(await renderer.fidelity());
    pack.manifest.pictures[0].drawings[0].fidelity = { rmse: 0.004, maximum: 0.1 };
    found.push(await renderer.fidelity());
    const points = [{ level: 0, step_mm: 0.75, rmse: 0.004, seen_rmse: 0.009, kept_light: 0.98 }];
    renderer.setStep(2 * renderer.step);
    await renderer.setClip({ planes: [[1, 0, 0, 0]] });
    draw();
    found.push(await renderer.fidelity(), await renderer.fidelity({ programs: [{ transfer: "shell", points }] }));
    renderer.dispose();
    return found;
    """
    step_mm = package.manifest.step_mm
    nothing, unknown, stated, cut, measured = browser.run(script, box_from_clip_of(package)[6].T.ravel().tolist())
    assert nothing is None
    assert (unknown["source"], unknown["rmse"]) == ("unknown", None)
    assert (stated["source"], stated["rmse"], stated["maximum"], stated["differs"]) == ("stated", 0.004, 0.1, [])
    assert (stated["format"], stated["version"]) == ("volpkg-fidelity", 1)
    assert (stated["program"], stated["level"], stated["step_mm"]) == ("shell", 0, step_mm)
    assert cut["differs"] == ["a part is cut away", f"it was judged with a step of {step_mm} mm"]
    assert (measured["source"], measured["kept_light"], measured["step_mm"]) == ("measured", 0.98, 2 * step_mm)
    # What the record promises: over visible pixels, as packages state it.
    assert measured["rmse"] == 0.009
    assert measured["differs"] == ["a part is cut away", "it was judged with a step of 0.75 mm"]


@pytest.mark.long
@pytest.mark.parametrize(("name", "kind"), [("segments", "webgl2"), ("segments in a mosaic", "webgl")])
def test_a_hit_names_the_segments_of_its_voxel(browser, server, scene_package, name, kind) -> None:
    package = scene_package(name)
    segments, grid = package.manifest.segments, package.manifest.grid
    labels = held_labels(package.manifest.textures, 0, package.read_bytes)
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    matrices = [box_from_clip_of(package)[view].T.ravel().tolist() for view in VIEWS]
    found = browser.run(SCRIPT, f"/package/{package.path.name}", matrices, PIXELS, 0.2, kind)
    assert found["error"] == 0
    named = set()
    for hit in filter(None, found["hits"]):
        x, y, z = (min(max(round(at), 0), n - 1) for at, n in zip(hit["voxel"], grid.shape_zyx[::-1], strict=True))
        assert hit["segments"] == list(segments.labels[labels[z, y, x]].segments)
        assert 0 <= hit["value"] <= 255
        named |= set(hit["segments"])
    assert len(named) > 1
