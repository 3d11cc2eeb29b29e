"""Pictures whose every pixel is known in closed form."""

import numpy as np
import pytest
from scene_builds import drawn, view_of
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.parts.mosaic.packing import Packing
from volprep.render.renderer import Renderer
from volprep.truth.camera import Camera, standard_views, view_from
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid

SHAPE_HW = (31, 37)
ASPECT = 37 / 31
COLOUR = (0.0, 0.0, 1.0)
"""Exact as bytes and as half floats."""
LAYOUTS = [(ES3, 1), (ES2, 1), (ES2, 4)]
layouts = pytest.mark.parametrize(("profile", "channels"), LAYOUTS, ids=["texture3d", "mosaic-scan-1", "mosaic-scan-4"])
projections = pytest.mark.parametrize("projection", ["orthographic", "perspective"])


def homogeneous(folder, grid, extinction_per_mm, profile=ES3, channels=1, **settings):
    """Package of a constant volume. A constant extinction is its own maximum, and so exact in RGBA8 too."""
    codes = np.full(grid.shape_zyx, 93, np.uint8)
    constant = function((0.0, COLOUR, extinction_per_mm))
    return tiny_package(folder, codes, constant, profile, grid=grid, packing=Packing(channels), **settings)


def chords_mm(grid, box_from_clip, shape_hw=SHAPE_HW):
    """Length of each pixel's ray inside the box, [H, W], in float64."""
    height, width = shape_hw
    x = (2 * np.arange(width) + 1) / width - 1
    y = 1 - (2 * np.arange(height) + 1) / height
    clip = np.stack(np.broadcast_arrays(x[None, :], y[:, None], -1.0, 1.0), axis=-1)
    near = clip @ box_from_clip.T
    far = (clip + np.array([0.0, 0.0, 2.0, 0.0])) @ box_from_clip.T
    origin = near[..., :3] / near[..., 3:]
    ray = far[..., :3] / far[..., 3:] - origin
    with np.errstate(divide="ignore"):
        low, high = -origin / ray, (np.array(grid.extent_mm_zyx[::-1]) - origin) / ray
    enter = np.clip(np.minimum(low, high).max(axis=-1), 0.0, None)
    leave = np.clip(np.maximum(low, high).min(axis=-1), None, 1.0)
    return np.clip(leave - enter, 0.0, None) * np.linalg.norm(ray, axis=-1)


def check_homogeneous(grid, package, camera, extinction_per_mm, step_mm=None):
    box_from_clip = camera.box_from_clip(grid, ASPECT)
    with Renderer(package, target="rgba32f") as renderer:
        picture = renderer.render(box_from_clip, SHAPE_HW, step_mm)
    chords = chords_mm(grid, box_from_clip)
    opacity = 1 - np.exp(-extinction_per_mm * chords)
    assert (opacity > 0).mean() > 0.05, "the volume is hardly in the picture"
    # Both ends of a chord carry some eight roundings of the distance at which the ray ends; with perspective w loses
    # a factor of far / near / 2 = 100 in the far point.
    roundings = 16 if camera.projection == "orthographic" else 2 * 100
    tolerance = extinction_per_mm * roundings * 2 * camera.focus_mm * 2.0**-24 + 1e-6
    np.testing.assert_allclose(picture[..., 3], opacity, rtol=0, atol=tolerance)
    np.testing.assert_allclose(picture[..., :3], opacity[..., None] * COLOUR, rtol=0, atol=tolerance)


@pytest.mark.long(keep=1)
@layouts
@projections
def test_a_homogeneous_volume_has_opacity_1_minus_exp_of_the_path_in_all_nine_views(
    tmp_path, profile, channels, projection
):
    grid = Grid.of((7, 5, 9), (1.3, 2.1, 0.9), (-3.0, 5.0, 11.0))
    package = homogeneous(tmp_path / "p", grid, 0.125, profile, channels, step_mm=0.45)
    for camera in standard_views(grid, projection).values():
        check_homogeneous(grid, package, camera, 0.125)


@pytest.mark.parametrize("code", [92, 94])
def test_a_shader_finds_the_entry_of_a_value(tmp_path, code):
    # A ramp of 8 entries: half an entry beside the value would be 0.016 per mm beside its extinction.
    ramp = function((90.0, COLOUR, 0.0), (98.0, COLOUR, 0.25))
    grid = Grid.of((7, 5, 9), (1.3, 2.1, 0.9))
    package = tiny_package(tmp_path / "p", np.full(grid.shape_zyx, code, np.uint8), ramp, ES3, grid=grid, step_mm=0.5)
    with Renderer(package, target="rgba32f") as renderer:
        box_from_clip = standard_views(grid)["anterior-left"].box_from_clip(grid, ASPECT)
        opacity = renderer.render(box_from_clip, SHAPE_HW)[..., 3]
    wanted = 1 - np.exp(-(code - 90) / 32 * chords_mm(grid, box_from_clip))
    assert wanted.max() > 0.3
    np.testing.assert_allclose(opacity, wanted, rtol=0, atol=1e-3)


@pytest.mark.parametrize("step_mm", [0.06, 0.3, 1.7, 50.0])
def test_opacity_does_not_depend_on_the_step(tmp_path, step_mm):
    grid = Grid.of((7, 5, 9), (1.3, 2.1, 0.9))
    package = homogeneous(tmp_path / "p", grid, 0.125)
    check_homogeneous(grid, package, standard_views(grid)["posterior-left"], 0.125, step_mm)


@pytest.mark.long(keep=3)
@layouts
@projections
@pytest.mark.parametrize("spacing_mm_zyx", [(100.0, 1.0, 1.0), (1.0, 100.0, 1.0), (1.0, 1.0, 100.0)], ids=str)
def test_steps_are_millimetres_where_voxels_are_100_times_longer_than_wide(
    tmp_path, profile, channels, projection, spacing_mm_zyx
):
    z, y, x = (2 if h == 100.0 else 157 for h in spacing_mm_zyx)
    grid = Grid.of((z, y, x), spacing_mm_zyx)
    package = homogeneous(tmp_path / "p", grid, 1 / 128, profile, channels, step_mm=0.5)
    for name in ("anterior", "superior", "anterior-right"):
        check_homogeneous(grid, package, standard_views(grid, projection)[name], 1 / 128, step_mm=5.0)


@layouts
@projections
def test_one_voxel_is_a_box(tmp_path, profile, channels, projection):
    grid = Grid.of((1, 1, 1), (3.0, 2.0, 5.0))
    package = homogeneous(tmp_path / "p", grid, 0.25, profile, channels)
    for name in ("left", "posterior-left"):
        check_homogeneous(grid, package, standard_views(grid, projection)[name], 0.25)


def test_an_eye_inside_the_volume_sees_what_is_in_front_of_it(tmp_path):
    grid = Grid.of((9, 9, 9), (1.0, 1.0, 1.0))
    package = homogeneous(tmp_path / "p", grid, 0.25)
    camera = Camera((4.0, 3.0, 5.0), (1.0, 0.2, -0.1), (0.0, 0.0, 1.0), 12.0, 20.0, "perspective")
    check_homogeneous(grid, package, camera, 0.25)


def test_faint_segments_add_up(tmp_path):
    """A depth of 1e-8 in each of 6400 segments: as 1 - exp(-1e-8) in float32, each would be nothing."""
    grid = Grid.of((4, 4, 4), (16.0, 16.0, 16.0))
    package = homogeneous(tmp_path / "p", grid, 2.0**-20)
    picture = drawn(package, "left", (5, 5), step_mm=0.01, target="rgba32f")
    opacity = 1 - np.exp(-(2.0**-20) * 64)
    # The exponential and the subtraction from 1 round by 2^-24 each.
    assert picture[2, 2, 3] == pytest.approx(opacity, abs=2 * 2.0**-24)


@pytest.mark.parametrize("extinction_per_mm", [1e-7, 1e-3, 1.0, 1e3, 65504.0, 1e9])
def test_opacity_stays_between_0_and_1_whatever_the_extinction(tmp_path, extinction_per_mm):
    grid = Grid.of((3, 3, 3), (10.0, 10.0, 10.0))
    package = homogeneous(tmp_path / "p", grid, extinction_per_mm)
    picture = drawn(package, "anterior-left", (17, 17), step_mm=3.0, target="rgba32f")
    assert np.isfinite(picture).all()
    assert picture.min() >= 0.0
    assert picture.max() <= 1.0 + 2.0**-22
    if extinction_per_mm >= 1e3:
        assert picture[8, 8, 3] == 1.0


@layouts
def test_a_ray_that_misses_gives_exactly_nothing(tmp_path, profile, channels):
    grid = Grid.of((4, 4, 4), (1.0, 1.0, 1.0))
    package = homogeneous(tmp_path / "p", grid, 1.0, profile, channels)
    picture = drawn(package, "anterior", (32, 32))
    # 4 of 6.93 mm, in 32 pixels.
    inside = np.abs(np.arange(32) - 15.5) < 0.5 * 32 * 4 / np.sqrt(48)
    assert (picture[..., 3] > 0).tolist() == np.outer(inside, inside).tolist()
    assert not picture[~np.outer(inside, inside)].any()


DIRECTIONS = {
    "identity": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "flipped": ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "mirrored": ((1, 0, 0), (0, 1, 0), (0, 0, -1)),
    "turned": ((0, 0, 1), (-1, 0, 0), (0, -1, 0)),
}
PLACES = {
    "left": ((1.0, 0.0, 0.0), {"anterior": (0, 1), "posterior": (0, -1), "superior": (0, -1), "inferior": (0, 1)}),
    "front": ((0.0, -1.0, 0.0), {"left": (0, -1), "right": (0, 1), "superior": (-1, 0), "inferior": (-1, 0)}),
    "head": ((0.0, 0.0, 1.0), {"anterior": (-1, 0), "posterior": (-1, 0), "left": (-1, 0), "right": (-1, 0)}),
}


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("direction", DIRECTIONS.values(), ids=DIRECTIONS.keys())
@pytest.mark.parametrize("place", PLACES)
def test_what_is_left_in_front_and_up_is_where_a_radiologist_expects_it(tmp_path, direction, place):
    """Rows go down and columns to the right: (-1, 0) is up, (0, 1) is right."""
    grid = Grid.of((11, 11, 11), (1.0, 1.0, 1.0), (5.0, -7.0, 90.0), direction)
    side, expected = PLACES[place]
    z, y, x = np.indices(grid.shape_zyx)
    world = np.stack([x, y, z], axis=-1) @ np.array(direction).T
    distance = np.linalg.norm(world - world.reshape(-1, 3).mean(axis=0) - 3 * np.array(side), axis=-1)
    codes = np.where(distance < 1.5, 255, 0).astype(np.uint8)
    marker = function((0.0, (1.0, 1.0, 1.0), 0.0), (255.0, (1.0, 1.0, 1.0), 1.0))
    package = tiny_package(tmp_path / "p", codes, marker, grid=grid)
    views = standard_views(grid)
    with Renderer(package) as renderer:
        for name, (down, right) in expected.items():
            opacity = renderer.render(views[name].box_from_clip(grid, 1.0), (64, 64))[..., 3]
            rows, columns = np.indices(opacity.shape) - 31.5
            # 3 mm of 19.05 mm, in 64 pixels.
            offset = 64 * 3 / np.linalg.norm(grid.extent_mm_zyx)
            assert np.average(rows, weights=opacity) == pytest.approx(down * offset, abs=0.3)
            assert np.average(columns, weights=opacity) == pytest.approx(right * offset, abs=0.3)


def test_an_eye_in_front_sees_what_the_anterior_view_shows(tmp_path):
    grid = Grid.of((5, 6, 7), (1.0, 1.0, 1.0), (5.0, -7.0, 90.0))
    codes = np.random.default_rng(1).integers(0, 256, grid.shape_zyx, dtype=np.uint8)
    package = tiny_package(tmp_path / "p", codes, function((0.0, COLOUR, 0.0), (255.0, COLOUR, 1.0)), grid=grid)
    centre = grid.corner_mm_xyz + np.array(grid.extent_mm_zyx[::-1]) / 2
    eye = tuple((centre - [0.0, 400.0, 0.0]).tolist())
    with Renderer(package) as renderer:
        named = renderer.render(view_of(grid, "anterior"), (16, 16))
        free = renderer.render(view_from(grid, eye).box_from_clip(grid, 1.0), (16, 16))
    np.testing.assert_allclose(free, named, atol=1 / 255)


def test_no_camera_fits_an_eye_in_the_middle_of_the_volume():
    grid = Grid.of((5, 6, 7), (1.0, 1.0, 1.0))
    with pytest.raises(VolprepError, match="VP5020"):
        view_from(grid, (3.0, 2.5, 2.0))


@layouts
@pytest.mark.parametrize("edge_mm", [0.0, 4.0], ids=["low face", "high face"])
def test_a_ray_that_runs_in_a_face_sees_the_whole_volume_or_nothing(tmp_path, profile, channels, edge_mm):
    """Such a ray neither enters nor leaves between two faces: 0 / 0."""
    grid = Grid.of((4, 4, 4), (1.0, 1.0, 1.0), (0.5, 0.5, 0.5))
    package = homogeneous(tmp_path / "p", grid, 0.25, profile, channels)
    camera = Camera((edge_mm, -10.0, 2.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), 2.0, 20.0)
    with Renderer(package, target="rgba32f") as renderer:
        picture = renderer.render(camera.box_from_clip(grid, 1.0), (3, 3))
    opacity = 1 - np.exp(-0.25 * 4)
    edge = picture[:, 1, 3]
    assert np.ptp(edge) == 0.0
    assert edge[0] == 0.0 or abs(edge[0] - opacity) < 1e-5
    inside = picture[:, 2 if edge_mm == 0.0 else 0, 3]
    np.testing.assert_allclose(inside, opacity, atol=1e-5)


def test_an_extinction_below_the_largest_of_its_table_of_bytes_is_exact(tmp_path):
    grid = Grid.of((3, 4, 5), (1.0, 1.0, 1.0))
    # The root of the 25th part of the largest is 51/255, a byte.
    rising = function((0.0, COLOUR, 0.08), (150.0, COLOUR, 0.08), (255.0, COLOUR, 2.0))
    codes = np.full(grid.shape_zyx, 93, np.uint8)
    package = tiny_package(tmp_path / "p", codes, rising, ES2, grid=grid)
    check_homogeneous(grid, package, standard_views(grid)["anterior-left"], 0.08)
