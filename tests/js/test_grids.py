"""Channels on several grids in a page: each can be faded, and picking tells the value of each."""

import numpy as np
import pytest
from format_samples import SAMPLES
from scipy.ndimage import map_coordinates

from volprep.truth.camera import standard_views
from volprep.truth.decoded import level_volume
from volprep_formats.grid import box_from_box
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.reader import Package

SIZE = 48
SCRIPT = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const [url, matrices] = given;
const gl = new OffscreenCanvas(48, 48).getContext("webgl2");
const pack = await openPackage(url);
const renderer = await createRenderer(gl, pack);
await renderer.ready;
const read = (boxFromClip) => {
  renderer.draw({ boxFromClip });
  renderer.present({ background: [0, 0, 0] });
  const pixels = new Uint8Array(48 * 48 * 4);
  gl.readPixels(0, 0, 48, 48, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return [...pixels];
};
const hits = [];
const both = read(matrices.both);
const pixels = [[24.5, 24.5], [20.5, 22.5], [27.5, 20.5]];
for (const pixel of pixels) hits.push(await renderer.pick(...pixel, { opacity: 0.1 }));
const slices = [];
for (const medium of [0, 1]) {
  const slice = await renderer.slice({ plane: "coronal", at: 0.6, size: 20, medium });
  slices.push({ ...slice, values: [...slice.values] });
}
await renderer.setTransfer({ opacity: 0 }, "hot");
const hidden = read(matrices.both);
await renderer.setTransfer({ opacity: 0.3 }, "hot");
const faded = read(matrices.both);
await renderer.setTransfer(null, "hot");
const again = read(matrices.both);
const codes = [];
for (const [name, opacity] of [["nobody", 1], ["hot", -1], ["hot", NaN]]) {
  try {
    await renderer.setTransfer({ opacity }, name);
  } catch (error) {
    codes.push(error.code);
  }
}
const grids = { both: renderer.grid };
await renderer.setProgram("grey");
const grey = read(matrices.grey);
grids.grey = renderer.grid;
const error = gl.getError();
renderer.dispose();
return { both, hidden, faded, again, grey, hits, slices, codes, grids, error };
"""


@pytest.fixture(scope="module")
def package() -> Package:
    return Package.open(SAMPLES["two-grids"].package)


@pytest.fixture
def found(browser, server, package) -> dict:
    camera = standard_views(package.manifest.box)["anterior-left"]
    boxes = {"both": package.manifest.box, "grey": package.manifest.grid}
    matrices = {name: camera.box_from_clip(grid, 1.0).T.ravel().tolist() for name, grid in boxes.items()}
    server.folders["package"] = package.path.parent
    if not browser.run("return location.href").startswith(server.url):
        browser.open(f"{server.url}/")
    return browser.run(SCRIPT, f"/package/{package.path.name}", matrices)


def test_a_medium_is_faded_and_hidden_and_comes_back(found) -> None:
    both, hidden, faded, grey = (np.array(found[name]) for name in ("both", "hidden", "faded", "grey"))
    assert found["error"] == 0
    assert found["again"] == found["both"]
    # Without the other medium it is the picture of the first one, in another box.
    assert np.abs(hidden - grey).max() <= 3
    assert np.abs(both - hidden).max() > 60
    assert 10 < np.abs(faded - hidden).max() < np.abs(both - hidden).max()
    assert found["codes"] == ["VP7084"] * 3


def test_each_picture_has_the_grid_of_its_box(found, package) -> None:
    assert found["grids"]["both"]["shape_zyx"] == list(package.manifest.box.shape_zyx)
    assert found["grids"]["grey"]["shape_zyx"] == list(package.manifest.grid.shape_zyx)


def value_at(package: Package, medium, at_mm: np.ndarray) -> np.ndarray:
    """Values of a channel at places [n, xyz] in box millimetres of the picture; NaN outside of its own grid."""
    part = channel_packages(package)[medium.channel]
    matrix = np.array(box_from_box(part.manifest.grid, medium.affine, package.manifest.box))
    at = at_mm @ matrix[:, :3].T + matrix[:, 3]
    volume = level_volume(part, 0)
    place = at[:, ::-1] / part.manifest.grid.spacing_mm_zyx - 0.5
    stored = map_coordinates(volume.stored.astype(float), place.T, order=1, mode="nearest")
    inside = ((at >= 0) & (at <= part.manifest.grid.extent_mm_zyx[::-1])).all(axis=1)
    return np.where(inside, volume.slope * stored + volume.intercept, np.nan)


def test_slices_tell_the_values_of_each_channel(found, package) -> None:
    world_to_box = np.linalg.inv(package.manifest.box.world_from_box)
    for medium, slice_ in zip(package.manifest.pictures[0].media, found["slices"], strict=True):
        width, height = slice_["width"], slice_["height"]
        down, right = np.mgrid[:height, :width] + 0.5
        # Coronal: the patient's right is on the left, the head above.
        x, y, z = slice_["corner_mm"]
        place = np.stack([x + right * slice_["pixel_mm"], 0 * right + y, z - down * slice_["pixel_mm"]], -1)
        expected = value_at(package, medium, place.reshape(-1, 3) @ world_to_box[:3, :3].T + world_to_box[:3, 3])
        values = np.array([np.nan if value is None else value for value in slice_["values"]], float)
        told = ~np.isnan(values) & ~np.isnan(expected)
        # Pixels at the border of a grid are of either side.
        assert (np.isnan(values) != np.isnan(expected)).mean() < 0.03
        assert told.sum() > 40
        assert np.ptp(expected[told]) > 5
        assert values[told] == pytest.approx(expected[told], abs=1.0)


def test_picking_tells_the_value_of_each_channel(found, package) -> None:
    both = package.manifest.pictures[0]
    seen = [hit for hit in found["hits"] if hit is not None]
    assert len(seen) >= 2
    told = 0
    for hit in seen:
        assert hit["value"] is None
        assert hit["values"].keys() == {"tissue", "activity"}
        for medium in both.media:
            (expected,) = value_at(package, medium, np.array([hit["box_mm"]]))
            value = hit["values"][medium.channel]
            if np.isnan(expected):
                assert value is None
                continue
            assert value == pytest.approx(expected, abs=1.0)
            told += 1
    assert told >= 3
