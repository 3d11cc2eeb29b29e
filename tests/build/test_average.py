"""The average of each ray: from the scene to the picture and the verdict."""

import numpy as np
import pytest
from judged import validate
from scene_builds import built, drawn, write_raw_scene

SHAPE_ZYX = (14, 30, 26)
WINDOW = """
[[transfer]]
name = "x-ray"
reference_mm = 1.0
points = [
    { value = 0.0, colour = "#000000", opacity = 0.98 },
    { value = 400.0, colour = "#ffffff", opacity = 0.98 },
]
"""
PROFILES = {"gles3": "", "gles2-2048": "", "gles3-bricks": "[bricks]\nsize = 8\n", "gles3-grid": "[grid]\nsize = 12\n"}


def package_of(folder, name, voxels):
    profile = name.removesuffix("-bricks").removesuffix("-grid")
    tables = f"""[pyramid]
coarsest_longest_axis = 15
[skip]
kind = "distance"
{PROFILES[name]}
[render]
compositing = "average"
picture_size = 64
{WINDOW}"""
    return built(write_raw_scene(folder, voxels.astype("<i2"), tables, profile=profile, top=""))


def ribs():
    """Bright bars in grey, with air outside."""
    z, y, x = np.meshgrid(*(np.arange(n) for n in SHAPE_ZYX), indexing="ij")
    body = ((x - 13) / 11) ** 2 + ((y - 15) / 13) ** 2 < 1
    return np.where(body, 200 + 500 * (z % 4 == 0) * ((x - 13) ** 2 + (y - 15) ** 2 > 60), 0)


@pytest.fixture(scope="module", params=PROFILES)
def package(request, tmp_path_factory):
    return package_of(tmp_path_factory.mktemp(request.param), request.param, ribs())


def test_the_reversed_view_is_the_same_picture(package) -> None:
    picture, back = drawn(package, "anterior-left"), drawn(package, "posterior")
    assert picture[..., 0].max() > 0.2
    front = drawn(package, "anterior")
    assert np.abs(front - back[:, ::-1]).max() <= 1 / 255 + 1e-6


def test_nothing_is_cropped_or_skipped_and_levels_hold_means(package) -> None:
    assert package.manifest.grid.shape_zyx == package.manifest.levels[0].grid.shape_zyx
    assert package.manifest.source.info.grid.shape_zyx == SHAPE_ZYX
    assert package.manifest.levels[0].index > 0 or package.manifest.grid.shape_zyx == SHAPE_ZYX
    assert not any(texture.role == "skip" for texture in package.manifest.textures)
    assert all(level.filter == "box" for level in package.manifest.levels[1:])


@pytest.mark.long
@pytest.mark.parametrize("package", ["gles3", "gles2-2048"], indirect=True)
def test_it_is_within_the_tolerance_and_the_error_falls_with_the_step(package) -> None:
    report = validate(package)
    assert report.verdict.failed == 0
    assert report.verdict.differing == ()
    (program, *_) = report.programs
    assert max(view.total.rmse for view in program.views) < 0.01
    assert program.sweep.convergence.expected == 2.0


@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_a_scan_of_one_value_is_drawn_as_that_value(tmp_path, profile) -> None:
    package = package_of(tmp_path, profile, np.full(SHAPE_ZYX, 100))
    picture = drawn(package, "anterior-right")
    inside = picture[..., 3] > 0.5
    assert inside.sum() > 500
    # Linear in light from black to white over 0 to 400, at an opacity of 0.98.
    assert np.abs(picture[inside][:, 0] - 0.25 * 0.98).max() < 2 / 255
