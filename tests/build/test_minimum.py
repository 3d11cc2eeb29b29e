"""Minimum intensity projection: from the scene to the picture and the verdict."""

from functools import partial

import numpy as np
import pytest
import scene_builds
from judged import validate
from scene_builds import assert_skipping_changes_no_pixel, built, write_raw_scene

from volprep.report.page import page

SHAPE_ZYX = (20, 44, 48)
AIR = """
[[transfer]]
name = "airways"
reference_mm = 2.0
points = [
    { value = 200.0, colour = "#ffffff", opacity = 0.99 },
    { value = 600.0, colour = "#000000", opacity = 0.0 },
]
"""


def airways() -> np.ndarray:
    """Two bent dark tubes in bright tissue with a little noise."""
    z, y, x = np.meshgrid(*(np.arange(n) for n in SHAPE_ZYX), indexing="ij")
    noise = np.random.default_rng(5).uniform(0, 60, SHAPE_ZYX)
    one = 700 * np.exp(-((x - 12 - 3 * np.sin(z / 4)) ** 2 + (y - 14) ** 2) / 6)
    other = 600 * np.exp(-((x - 14 - z) ** 2 + (y - 34) ** 2) / 9)
    return np.rint(900 - np.maximum(one, other) + noise).astype("<i2")


PROFILES = {"gles3": "", "gles2-2048": "", "gles3-bricks": "[bricks]\nsize = 8\n", "gles3-grid": "[grid]\nsize = 16\n"}


@pytest.fixture(scope="module", params=PROFILES)
def package(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    profile = request.param.removesuffix("-bricks").removesuffix("-grid")
    tables = f"""[pyramid]
coarsest_longest_axis = 24
[skip]
kind = "distance"
block = 4
{PROFILES[request.param]}
[render]
compositing = "minimum"
picture_size = 64
{AIR}"""
    return built(write_raw_scene(folder, airways(), tables, profile=profile, top=""))


drawn = partial(scene_builds.drawn, shape_hw=(96, 96))


@pytest.mark.long(keep=1)
def test_the_reversed_view_is_the_same_picture(package) -> None:
    for one, other in (("anterior", "posterior"), ("left", "right")):
        picture, back = drawn(package, one), drawn(package, other)
        assert picture[..., 3].max() > 0.5
        assert np.abs(picture - back[:, ::-1]).max() <= 1 / 255 + 1e-6


@pytest.mark.long(keep=1)
def test_skipping_changes_no_pixel_and_tissue_is_empty(package) -> None:
    assert_skipping_changes_no_pixel(package, (96, 96))
    assert package.manifest.grid.shape_zyx[1] < SHAPE_ZYX[1]


def test_each_coarse_level_was_made_of_means_and_of_the_least_of_its_voxels(package) -> None:
    reasons = [item.reason for item in package.manifest.plan if item.kind == "level-filter"]
    assert len(reasons) == len(package.manifest.levels) - 1
    assert all("box 0." in reason and "minimum 0." in reason for reason in reasons)


@pytest.mark.long
@pytest.mark.parametrize("package", ["gles3", "gles2-2048"], indirect=True)
def test_it_is_within_the_tolerance_and_comes_near_the_scan(package) -> None:
    report = validate(package)
    assert report.verdict.code == "within", report.verdict.worse
    assert max(view.total.rmse for program in report.programs for view in program.views) < 0.012
    text = page(report)
    assert "the least value of the scan along each ray" in text
    assert "integral of the scan" not in text
