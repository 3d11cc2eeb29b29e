"""Maximum intensity difference accumulation: from the scene to the picture, the verdict, and what is refused."""

import numpy as np
import pytest
from judged import validate
from scene_builds import assert_skipping_changes_no_pixel, built, write_raw_scene

from volprep_formats.diagnostics import VolprepError

SHAPE_ZYX = (34, 44, 48)
VEIL = """
[[transfer]]
name = "veil"
reference_mm = 10.0
points = [
    { value = 100.0, colour = "#4060ff", opacity = 0.0 },
    { value = 300.0, colour = "#80a0ff", opacity = 0.4 },
    { value = 1000.0, colour = "#ffffff", opacity = 0.95 },
]
"""
LAYOUTS = {
    "texture3d": ("gles3", ""),
    "bricks": ("gles3", "[bricks]\nsize = 8\n"),
    "grid": ("gles3", "[grid]\nsize = 24\n"),
    "mosaic": ("gles2-2048", ""),
    "proxy": ("gles3", "[proxy]\nblock = 4\n"),
}


def package_of(folder, layout="texture3d", transfer=VEIL):
    """A bright ball in a larger dim one, in air."""
    profile, more = LAYOUTS[layout]
    z, y, x = np.meshgrid(*(np.arange(n) for n in SHAPE_ZYX), indexing="ij")
    far = np.sqrt((x - 16) ** 2 + (y - 18) ** 2 + (z - 16) ** 2)
    voxels = np.clip(330 * np.clip((14 - far) / 3, 0, 1) + 670 * np.clip((5 - far) / 2, 0, 1), 0, 1000)
    tables = f"""[pyramid]
coarsest_longest_axis = 24
[skip]
kind = "distance"
block = 4
{more}
[render]
compositing = "mida"
picture_size = 32
{transfer}"""
    return built(write_raw_scene(folder, np.rint(voxels).astype("<i2"), tables, profile=profile))


@pytest.fixture(scope="module", params=LAYOUTS)
def package(request, tmp_path_factory):
    return package_of(tmp_path_factory.mktemp(request.param), request.param)


@pytest.mark.long(keep=1)
def test_skipping_changes_no_pixel(package) -> None:
    assert_skipping_changes_no_pixel(package)


@pytest.mark.long
@pytest.mark.parametrize("package", ["texture3d", "mosaic"], indirect=True)
def test_it_is_within_the_tolerance_of_the_refined_truth(package) -> None:
    report = validate(package)
    assert report.verdict.failed == 0
    assert report.verdict.differing == ()
    (program, *_) = report.programs
    assert max(view.total.rmse for view in program.views) < 2 / 255
    assert max(view.truth_bound for view in program.views) <= 1.0001e-6


@pytest.mark.parametrize(
    "transfer",
    [
        VEIL.replace("reference_mm", "intensities = [400.0, 400.0]\nreference_mm"),
        '[[transfer]]\nname = "veil"\npoints = [{ value = 3.0, colour = "#ffffff", extinction_per_mm = 1.0 }]\n',
    ],
)
def test_a_range_without_width_is_refused(tmp_path, transfer) -> None:
    with pytest.raises(VolprepError, match="range of intensities") as found:
        package_of(tmp_path, transfer=transfer)
    assert found.value.code == "VP3118"
