"""Compositing back to front gives the picture of emission and absorption, but for rounding."""

from functools import partial

import numpy as np
import pytest
import scene_builds
from judged import validate
from scene_builds import assert_skipping_changes_no_pixel, built, write_raw_scene

from volprep_formats.diagnostics import VolprepError

SHAPE_ZYX = (17, 22, 25)
GLASS = """
[[transfer]]
name = "glass"
reference_mm = 5.0
points = [
    { value = 90.0, colour = "#3060ff", opacity = 0.0 },
    { value = 140.0, colour = "#ff8040", opacity = 0.3 },
    { value = 255.0, colour = "#ffffff", opacity = 0.9 },
]
"""


def package_of(folder, compositing, profile, more="", *, render="", shape=SHAPE_ZYX):
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij")
    noise = np.random.default_rng(4).uniform(0, 30, shape)
    ball = (np.clip(210 - 190 * (x**2 + y**2 + z**2), 0, 220) + noise).astype(np.uint8)
    tables = f"""[skip]
kind = "distance"
block = 4
{more}
[render]
compositing = "{compositing}"
opacity_cutoff = 1.0
picture_size = 32
{render}
{GLASS}"""
    return built(write_raw_scene(folder, ball, tables, profile=profile), folder / f"{compositing}.volpkg")


drawn = partial(scene_builds.drawn, target="rgba32f")

CASES = {
    "texture3d": ("gles3", "", ""),
    "texture3d-lit": ("gles3", "", 'lighting = "headlight"'),
    "palette": ("gles3", "", 'classification = "palette"'),
    "bricks": ("gles3", "[bricks]\nsize = 8\n", ""),
    "mosaic": ("gles2-2048", "", ""),
}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(("profile", "more", "render"), CASES.values(), ids=CASES.keys())
def test_the_picture_is_that_of_emission_and_absorption(tmp_path, profile, more, render) -> None:
    forth, back = (
        package_of(tmp_path, name, profile, more, render=render) for name in ("emission-absorption", "back-to-front")
    )
    target = "rgba8" if profile.startswith("gles2") else "rgba32f"
    for view in ("anterior", "posterior-left"):
        one, other = (drawn(each, view, target=target) for each in (forth, back))
        assert one[..., 3].max() > 0.5
        assert np.ptp(one[..., :3]) > 0.2
        # Samples lie in the same places up to float32's rounding, and a palette has steps.
        assert np.abs(one - other).max() < (0.02 if "palette" in render else 1.01 / 255 if target == "rgba8" else 2e-4)
        assert np.abs(one - other).mean() < (1e-4 if target == "rgba8" else 4e-6)


@pytest.mark.long
def test_skipping_changes_no_pixel(tmp_path) -> None:
    package = package_of(tmp_path, "back-to-front", "gles3", shape=(50, 66, 66))
    assert_skipping_changes_no_pixel(package)


@pytest.mark.long
def test_it_is_within_the_tolerance(tmp_path) -> None:
    package = package_of(tmp_path, "back-to-front", "gles3")
    report = validate(package.path, tmp_path / "report")
    assert report.verdict.failed == 0
    assert report.verdict.differing == ()
    assert report.programs[0].sweep.convergence.expected == 2.0


def test_rays_from_the_far_end_do_not_begin_at_proxy_geometry(tmp_path) -> None:
    with pytest.raises(VolprepError, match=r"\[proxy\]") as found:
        package_of(tmp_path, "back-to-front", "gles3", "[proxy]\n")
    assert found.value.code == "VP3045"
