"""Every technique: against the oracle, cameras and sizes at the ends of what there is, and no leaks.

Orders are in tests/truth/test_every_order.py.
"""

import numpy as np
import pytest
from published import TWINS
from scene_builds import view_of
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.parts.mosaic.packing import Packing
from volprep.render.renderer import Renderer
from volprep.techniques import TECHNIQUES
from volprep.truth.convergence import fit_order
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Medium, Volume
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid

HW = (40, 40)
GRID = Grid.of((9, 11, 10), (1.4, 0.8, 1.1), (3.0, -20.0, 7.0))
Z_, Y_, X_ = np.meshgrid(*(np.linspace(-1, 1, n) for n in GRID.shape_zyx), indexing="ij")
CODES = np.rint(127.5 + 127.5 * np.cos(2 * X_ + Y_) * np.sin(1.5 * Z_ - Y_ + 0.5)).astype(np.uint8)
# Tables of two entries hold it exactly as half floats; those of RGBA8 hold an extinction that is the same everywhere.
FAINT = function((0.0, (0.0, 0.0, 1.0), 0.0), (255.0, (1.0, 0.0, 0.0), 0.05))
DENSE = function((0.0, (0.0, 0.0, 1.0), 0.0), (255.0, (1.0, 0.0, 0.0), 0.5))
EVEN = function((0.0, (0.0, 0.0, 1.0), 0.3), (255.0, (1.0, 1.0, 0.0), 0.3))
PROJECTIONS = ["orthographic", "perspective"]
CONVERGENT = [name for name, technique in TECHNIQUES.items() if technique.order is None]
DIVERGENT = [name for name, technique in TECHNIQUES.items() if technique.order is not None]


def camera(view, projection="orthographic"):
    return view_of(GRID, view, projection)


def truth_of(transfer_function, box_from_clip, shape_hw=HW):
    return oracle_picture(Volume(CODES, GRID), transfer_function, box_from_clip, shape_hw, tolerance=1e-8).rgba


def package_of(folder, technique, profile=ES3, transfer_function=DENSE, **wishes):
    return tiny_package(folder, CODES, transfer_function, profile, grid=GRID, entries=2, technique=technique, **wishes)


def rmse(picture, truth):
    return float(np.sqrt(np.mean((picture - truth) ** 2)))


@pytest.mark.parametrize("technique", DIVERGENT)
def test_what_is_published_with_an_error_has_the_order_that_its_record_says(tmp_path, technique):
    box_from_clip = camera("superior")
    truth = truth_of(FAINT, box_from_clip)
    # From 0.1 mm on: longer steps leave rays of fixed opacities transparent.
    steps = [0.1 / 2**k for k in range(5)]
    errors = {}
    for name in (technique, technique.removesuffix("-as-published")):
        package = package_of(tmp_path / name, name, transfer_function=FAINT)
        with Renderer(package, target="rgba32f") as renderer:
            errors[name] = [rmse(renderer.render(box_from_clip, HW, step), truth) for step in steps]
    right, published = errors.pop(technique.removesuffix("-as-published")), errors.pop(technique)
    assert fit_order(steps, published, floor=0.0).order == pytest.approx(TECHNIQUES[technique].order, abs=0.05)
    assert min(published) > 3 * max(right)


@pytest.mark.parametrize("profile", [ES3, ES2], ids=["texture3d", "mosaic"])
@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("technique", DIVERGENT)
def test_what_is_published_with_an_error_draws_what_its_twin_draws(tmp_path, technique, projection, profile):
    box_from_clip = camera("anterior-left", projection)
    flat = function((0.0, (0.0, 0.0, 1.0), 0.03), (255.0, (1.0, 0.0, 0.0), 0.03))
    package = package_of(tmp_path / "p", technique, profile, flat)
    with Renderer(package, target="rgba32f") as renderer:
        picture = renderer.render(box_from_clip, HW, 0.7)
    expected = TWINS[technique](Medium(Volume(CODES, GRID), flat), box_from_clip, HW, 0.7)
    # Bytes and half floats of tables; what lies on the border of the volume, or between two positions of 8 bits, may
    # fall on either side.
    assert np.quantile(np.abs(picture - expected), 0.99) < 2e-3
    assert rmse(picture, expected) < 2e-3


@pytest.mark.parametrize("packing", [Packing(), Packing(4)], ids=["one-channel", "four-channels"])
@pytest.mark.parametrize("technique", [name for name in CONVERGENT if "mosaic" in TECHNIQUES[name].samplings])
def test_through_mosaics_pictures_agree_with_the_oracle_too(tmp_path, technique, packing):
    package = package_of(tmp_path / "p", technique, ES2, EVEN, packing=packing)
    with Renderer(package, target="rgba32f") as renderer:
        for projection in PROJECTIONS:
            box_from_clip = camera("posterior-left", projection)
            picture = renderer.render(box_from_clip, HW, 0.1)
            # Bytes: colour is off by 0.5 / 255, and extinction by 0.3 / 255 on paths of up to 17 mm.
            assert np.abs(picture - truth_of(EVEN, box_from_clip)).max() < 0.5 / 255 + 0.3 / 255 * 17 * 0.3


def perspective_from(eye_mm, towards_mm, near_mm=0.05, far_mm=100.0, slope=0.8):
    """Box space from clip coordinates, for an eye anywhere."""
    eye, towards = np.array(eye_mm, float), np.array(towards_mm, float)
    forward = (towards - eye) / np.linalg.norm(towards - eye)
    right = np.cross(forward, [0.3, 0.2, 0.9])
    right /= np.linalg.norm(right)
    box_from_eye = np.eye(4)
    box_from_eye[:3, :3] = np.column_stack([right, np.cross(right, forward), -forward])
    box_from_eye[:3, 3] = eye
    depth = far_mm - near_mm
    clip_from_eye = np.array(
        [
            [1 / slope, 0, 0, 0],
            [0, 1 / slope, 0, 0],
            [0, 0, -(near_mm + far_mm) / depth, -2 * near_mm * far_mm / depth],
            [0, 0, -1, 0],
        ]
    )
    return box_from_eye @ np.linalg.inv(clip_from_eye)


X, Y, Z = GRID.extent_mm_zyx[::-1]
MIDDLE = (X / 2, Y / 2, Z / 2)
CAMERAS = {
    "inside": perspective_from((X * 0.4, Y * 0.45, Z * 0.3), (X, Y * 0.6, Z * 0.9)),
    "on-a-face": perspective_from((0.0, Y * 0.4, Z * 0.6), MIDDLE),
    "on-an-edge": perspective_from((X, Y, Z * 0.6), MIDDLE),
    "near-plane-in-the-volume": perspective_from((-1.0, -2.0, -1.5), MIDDLE, near_mm=7.0),
    "far-plane-in-the-volume": perspective_from((-1.0, -2.0, -1.5), MIDDLE, far_mm=12.0),
    "along-an-axis": perspective_from((X / 2, Y / 2, -9.0), MIDDLE),
}


@pytest.mark.long(keep=6)
@pytest.mark.parametrize("technique", CONVERGENT)
@pytest.mark.parametrize("box_from_clip", CAMERAS.values(), ids=CAMERAS.keys())
def test_a_camera_may_stand_anywhere(tmp_path, technique, box_from_clip):
    truth = truth_of(DENSE, box_from_clip)
    assert truth[..., 3].max() > 0.5
    with Renderer(package_of(tmp_path / "p", technique), target="rgba32f") as renderer:
        picture = renderer.render(box_from_clip, HW, 0.05)
    assert np.abs(picture - truth).max() < 2e-3


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_a_volume_behind_the_eye_is_not_drawn_and_one_far_away_is_a_dot(tmp_path, technique):
    package = package_of(tmp_path / "p", technique, transfer_function=FAINT)
    behind = perspective_from((-3.0, -4.0, -5.0), (-9.0, -12.0, -15.0))
    away = perspective_from((-3e4, -4e4, -5e4), MIDDLE, near_mm=1e4, far_mm=1e5, slope=1e-2)
    with Renderer(package, target="rgba32f") as renderer:
        assert not renderer.render(behind, HW).any()
        picture = renderer.render(away, (41, 41))
    lit = picture[..., 3] > 0
    assert lit[20, 20]
    assert lit.sum() <= 9


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_pictures_of_one_pixel_and_of_8192_are_drawn_and_of_none_are_refused(tmp_path, technique):
    box_from_clip = camera("anterior-left")
    with Renderer(package_of(tmp_path / "p", technique)) as renderer:
        assert renderer.render(box_from_clip, (1, 1)).shape == (1, 1, 4)
        for shape_hw in ((1, 8192), (8192, 1)):
            assert renderer.render(box_from_clip, shape_hw)[..., 3].max() > 0.5
        for shape_hw in ((0, 5), (5, 0), (-1, 5), (100_000, 1)):
            with pytest.raises(VolprepError, match="VP5009"):
                renderer.render(box_from_clip, shape_hw)
        assert renderer.render(box_from_clip, (2, 3)).shape == (2, 3, 4)


@pytest.mark.long(keep=8)
@pytest.mark.parametrize("step_mm", [0.0, -1.0, float("nan"), float("inf"), 1e-9])
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_an_impossible_step_is_refused(tmp_path, technique, step_mm):
    with Renderer(package_of(tmp_path / "p", technique)) as renderer, pytest.raises(VolprepError, match="VP5019"):
        renderer.render(camera("left"), HW, step_mm)


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_a_step_longer_than_the_volume_is_one_sample(tmp_path, technique):
    box_from_clip = camera("left")
    with Renderer(package_of(tmp_path / "p", technique, transfer_function=FAINT), target="rgba32f") as renderer:
        picture = renderer.render(box_from_clip, HW, 1e6)
    assert 0.0 < picture[..., 3].max() <= 1.0


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_200_pictures_of_changing_size_leave_nothing_behind(tmp_path, technique):
    with Renderer(package_of(tmp_path / "p", technique)) as renderer:
        renderer.render(camera("left"), (3, 3))
        first = +renderer._gl.live
        for number in range(200):
            renderer.render(camera("left"), (2 + number % 3, 3), 0.5 + 0.1 * (number % 7))
        assert +renderer._gl.live == first


@pytest.mark.parametrize("technique", [name for name in CONVERGENT if not TECHNIQUES[name].loops])
def test_layers_that_8_bits_cannot_tell_from_nothing_are_blended_in_half_floats(tmp_path, technique):
    # Each of some 200 layers has a quarter of a step of 8 bits.
    faint = function((0.0, (1.0, 1.0, 1.0), 0.02), (255.0, (1.0, 1.0, 1.0), 0.02))
    box_from_clip = camera("left")
    package = package_of(tmp_path / "p", technique, transfer_function=faint)
    truth = truth_of(faint, box_from_clip)
    with Renderer(package) as renderer:
        assert rmse(renderer.render(box_from_clip, HW, 0.05), truth) < 2 / 255
    old = package_of(tmp_path / "old", technique, ES2, transfer_function=faint)
    assert [each.manifest.level_programs[0].target for each in (package, old)] == ["rgba16f", "rgba8"]
    with Renderer(old) as renderer:
        assert rmse(renderer.render(box_from_clip, HW, 0.05), truth) > 10 / 255
