"""What is seen fills a picture, in whatever shape, from wherever it is looked at."""

from pathlib import Path

import numpy as np
import pytest
from tiny_packages import ES3

from volprep import VolprepError, render_package
from volprep.pipeline.build import build
from volprep.pipeline.framing import window_of_seen
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep_formats.progress import Silent


def seen(rows: slice, columns: slice, shape_hw=(64, 64)) -> np.ndarray:
    opacity = np.full(shape_hw, 0.01, np.float32)
    opacity[rows, columns] = 0.5
    return opacity


@pytest.mark.parametrize(
    ("rows", "columns", "centre"),
    [
        (slice(24, 40), slice(24, 40), (0.0, 0.0)),
        (slice(0, 16), slice(0, 16), (-0.735, 0.735)),
        (slice(40, 48), slice(8, 24), (-0.5, -0.375)),
    ],
)
def test_a_window_holds_all_that_is_seen_with_little_around_it(rows, columns, centre) -> None:
    window = window_of_seen(seen(rows, columns))
    assert window[:2, 3] == pytest.approx(centre, abs=1e-9)
    # A corner of what is seen, in the clip coordinates of the whole, lies within those of the window, near their edge.
    for row, column in ((rows.start, columns.start), (rows.stop, columns.stop)):
        whole = np.array([column / 32 - 1, 1 - row / 32, 0, 1])
        assert np.all(np.abs(np.linalg.solve(window, whole)[:2]) <= 1 + 1e-9)
    assert window[0, 0] == window[1, 1] == pytest.approx(max(rows.stop - rows.start, 16) / 64 * 1.06)


def test_nothing_seen_and_all_seen_are_the_whole() -> None:
    assert np.array_equal(window_of_seen(np.zeros((8, 8), np.float32)), np.eye(4))
    assert np.array_equal(window_of_seen(np.ones((8, 8), np.float32)), np.eye(4))


@pytest.mark.parametrize("profile", [ES3, load_profile("gles1", Path())], ids=["es3", "es1"])
@pytest.mark.parametrize("shape_hw", [(40, 80), (80, 40), (60, 60)])
def test_what_is_seen_reaches_two_edges_of_a_picture_of_any_shape(tmp_path, profile, shape_hw) -> None:
    voxels = np.zeros((12, 12, 12), np.uint8)
    voxels[2:4, 3:9, 8:10] = 255
    scene = Scene.model_validate(
        {
            "name": "box",
            "source": {"path": str(tmp_path / "box.npy")},
            "transfer": [
                {
                    "name": "box",
                    "reference_mm": 1.0,
                    "points": [
                        {"value": 100.0, "colour": "#ffffff", "opacity": 0.0},
                        {"value": 200.0, "colour": "#ffffff", "opacity": 0.9},
                    ],
                }
            ],
        }
    )
    np.save(tmp_path / "box.npy", voxels)
    build(Request(scene, profile, tmp_path / "scene.toml"), tmp_path / "box.volpkg", Silent())
    picture = render_package(tmp_path / "box.volpkg", view="anterior-left", shape_hw=shape_hw, fill=True)
    rows, columns = np.nonzero(picture[..., 0] > 50)
    height, width = shape_hw
    empty = max(rows.min(), height - 1 - rows.max()) / height, max(columns.min(), width - 1 - columns.max()) / width
    assert min(empty) < 0.08
    assert min(rows.min(), columns.min()) > 0, "it is cut off"
    assert min(height - 1 - rows.max(), width - 1 - columns.max()) > 0, "it is cut off"
    with pytest.raises(VolprepError, match=r"VP5009 .* 0×5 pixels"):
        render_package(tmp_path / "box.volpkg", shape_hw=(5, 0), fill=True)
