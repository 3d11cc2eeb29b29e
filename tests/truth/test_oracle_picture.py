"""Pictures of the oracle: where pixels are, which part of a ray counts, and what must not change anything."""

import closed_forms
import numpy as np
import pytest
from tiny_packages import function

from volprep.truth.camera import Camera, standard_views
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid

GRID = Grid.of((5, 6, 7), (2.0, 1.5, 0.75), (-3.0, 40.0, 7.0), ((0.0, 0.8, 0.6), (1.0, 0.0, 0.0), (0.0, 0.6, -0.8)))
ROUNDING = 1e-12


def transfer(*points):
    return function(*((value, colour, extinction) for value, extinction, colour in points))


SOFT = transfer((20, 0.0, (1, 0, 0)), (90, 0.4, (0, 1, 0)), (160, 0.1, (0, 0, 1)), (255, 0.9, (1, 1, 1)))


def volume_of(grid, dtype=np.uint8):
    return np.random.default_rng(2).integers(0, 128, grid.shape_zyx).astype(dtype)


def picture(volume, grid=GRID, camera=None, shape_hw=(9, 12), function=SOFT, **options):
    camera = camera or standard_views(grid, "perspective")["anterior-left"]
    matrix = camera.box_from_clip(grid, shape_hw[1] / shape_hw[0])
    slope, intercept = options.get("slope", 1.0), options.get("intercept", 0.0)
    field = Volume(volume, grid, slope, intercept)
    return oracle_picture(field, function, matrix, shape_hw, options.get("tolerance", 1e-9))


def assert_same(one, other):
    error = np.abs(one.rgba - other.rgba).max(axis=-1)
    assert (error <= one.bound + other.bound + ROUNDING).all()
    assert one.rgba[..., 3].max() > 0.1


def test_row_0_is_on_top_and_column_0_on_the_left(oracle):
    # Looking along +z with x to the right and y up: a volume that shines at large x and large y.
    volume = np.zeros((2, 4, 4), np.uint8)
    volume[:, 3, 3] = 100
    camera = np.diag([2.0, 2.0, 5.0, 1.0])
    camera[:3, 3] = (2, 2, 0)
    rgba, _ = oracle.draw(volume, [oracle.point(99, 0.0), oracle.point(100, 1.0)], camera, shape_hw=(40, 40))
    rows, columns = np.nonzero(rgba[..., 3])
    assert (rows.min(), columns.max()) == (0, 39)
    assert rows.max() < 10
    assert columns.min() > 29


def test_pixels_are_sampled_at_their_centres(oracle):
    volume = (np.arange(8, dtype=np.float32) + 0.5)[None, None, :].repeat(3, axis=0).repeat(3, axis=1)
    points = [oracle.point(0.5, 0.1, (1, 0, 0)), oracle.point(7.5, 0.6, (0, 1, 0))]
    camera = np.diag([4.0, 1.5, -10.0, 1.0])  # looks along -z, 8 mm wide
    camera[:3, 3] = (4.0, 1.5, 1.5)
    rgba, _ = oracle.draw(volume, points, camera, shape_hw=(1, 5), tolerance=1e-12)
    for column in range(5):
        x = 8 * (column + 0.5) / 5
        share = (x - 0.5) / 7
        colour = (1 - share, share, 0)
        truth = closed_forms.layers_light([colour], [0.1 + 0.5 * share], [3.0])
        np.testing.assert_allclose(rgba[0, column], truth, atol=1e-12)


def test_only_what_lies_between_near_and_far_plane_counts(oracle):
    volume = np.full((10, 10, 10), 50, np.uint8)
    points = [oracle.point(50, 0.3, (1, 0.5, 0.25))]
    for start, length, inside in [(-4, 20, 10), (2.5, 20, 7.5), (-4, 9, 5), (3, 4, 4), (-8, 5, 0), (11, 5, 0)]:
        rgba, _ = oracle.draw(volume, points, oracle.ray((4.3, start, 5.1), (0, 1, 0), length))
        np.testing.assert_allclose(rgba[0, 0], closed_forms.layers_light([(1, 0.5, 0.25)], [0.3], [inside]), atol=1e-13)


def test_the_box_of_a_coarse_level_ends_before_its_last_voxel_does(oracle):
    volume = np.full((1, 1, 4), 50, np.uint8)  # 4 voxels of 2 mm for 7 mm
    rgba, _ = oracle.draw(
        volume,
        [oracle.point(50, 0.3)],
        oracle.ray((-1, 0.5, 0.5), (1, 0, 0), 20),
        spacing_mm_xyz=(2, 1, 1),
        extent_mm_xyz=(7, 1, 1),
    )
    np.testing.assert_allclose(rgba[0, 0, 3], -np.expm1(-0.3 * 7), atol=1e-14)


def test_a_picture_without_light_is_exactly_black():
    answer = picture(np.zeros(GRID.shape_zyx, np.uint8))
    assert not answer.rgba.any()
    assert not answer.bound.any()


def test_a_camera_that_looks_away_sees_nothing():
    camera = Camera((500.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 50.0, 100.0, "perspective")
    assert not picture(volume_of(GRID), camera=camera).rgba.any()


def test_perspective_rays_have_the_length_of_their_way_through_a_slab():
    grid = Grid.of((4, 50, 50), (0.5, 1.0, 1.0))
    camera = Camera((25.0, 24.0, -30.0), (0.1, 0.0, 1.0), (0.0, 1.0, 0.0), 30.0, 31.0, "perspective")
    function = transfer((0, 0.4, (0.5, 0.25, 1.0)))
    answer = picture(np.zeros(grid.shape_zyx, np.uint8), grid, camera, (8, 11), function)
    matrix = camera.box_from_clip(grid, 11 / 8)
    for row, column in np.ndindex(8, 11):
        clip = np.array([(2 * column + 1) / 11 - 1, 1 - (2 * row + 1) / 8, 0.0])
        ends = [matrix @ [*clip[:2], z, 1.0] for z in (-1.0, 1.0)]
        near, far = (end[:3] / end[3] for end in ends)
        length = 2.0 * np.linalg.norm(far - near) / abs(far - near)[2]
        truth = closed_forms.layers_light([(0.5, 0.25, 1.0)], [0.4], [length])
        np.testing.assert_allclose(answer.rgba[row, column], truth, atol=1e-12)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_a_rolled_camera_gives_the_rolled_picture(projection):
    views = standard_views(GRID, projection)
    camera = views["anterior-left"]
    forward = np.array(camera.forward)
    right = np.cross(forward, camera.up)
    rolled = Camera(camera.eye_mm_xyz, camera.forward, tuple(right), camera.height_mm, camera.focus_mm, projection)
    upright = picture(volume_of(GRID), camera=camera, shape_hw=(16, 16))
    turned = picture(volume_of(GRID), camera=rolled, shape_hw=(16, 16))
    # What was right is up now: the picture turned to the left by 90 degrees.
    turned_back = type(turned)(np.rot90(turned.rgba, -1), np.rot90(turned.bound, -1))
    assert_same(upright, turned_back)


@pytest.mark.parametrize("axes_zyx", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
@pytest.mark.parametrize("flipped", [(), (0,), (1, 2)])
def test_storing_the_volume_along_other_axes_changes_nothing(axes_zyx, flipped):
    volume = volume_of(GRID)
    direction = np.array(GRID.direction)
    origin = np.array(GRID.origin_mm_xyz)
    stored = volume.transpose(axes_zyx)
    direction = direction[:, [2 - axes_zyx[2], 2 - axes_zyx[1], 2 - axes_zyx[0]]]
    spacing = np.array(GRID.spacing_mm_zyx)[list(axes_zyx)]
    for axis in flipped:
        stored = np.flip(stored, axis)
        origin = origin + direction[:, 2 - axis] * spacing[axis] * (stored.shape[axis] - 1)
        direction[:, 2 - axis] *= -1
    grid = Grid.of(stored.shape, tuple(spacing), origin, direction)
    camera = standard_views(GRID, "perspective")["anterior-left"]
    other = picture(np.ascontiguousarray(stored), grid, camera)
    assert_same(picture(volume, camera=camera), other)


def test_the_number_of_threads_changes_no_bit(oracle):
    volume = volume_of(Grid.of((30, 31, 32), (1, 1, 1)))
    points = [oracle.point(20, 0.0, (1, 0, 0)), oracle.point(90, 0.1, (0, 1, 0)), oracle.point(90, 0.4, (0, 0, 1))]
    camera = np.diag([14.0, 14.0, 30.0, 1.0])
    camera[:3, :3] = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0] @ camera[:3, :3]
    camera[:3, 3] = (16, 15.5, 15)
    one, *others = [
        oracle.draw(volume, points, camera, shape_hw=(30, 31), threads=threads) for threads in (1, 2, 3, 7, 0)
    ]
    for other in others:
        np.testing.assert_array_equal(one.rgba, other.rgba)
        np.testing.assert_array_equal(one.bound, other.bound)


@pytest.mark.parametrize("dtype", [np.int16, np.uint16, np.float32])
def test_the_type_of_the_voxels_changes_no_bit(dtype):
    bytes_ = picture(volume_of(GRID))
    others = picture(volume_of(GRID, dtype))
    np.testing.assert_array_equal(bytes_.rgba, others.rgba)
    np.testing.assert_array_equal(bytes_.bound, others.bound)


@pytest.mark.parametrize(("slope", "intercept"), [(2.0, -1024.0), (-0.5, 300.0), (0.001, 0.0)])
def test_stored_values_stand_for_physical_ones(slope, intercept):
    mapped = transfer(*sorted((p.value * slope + intercept, p.extinction_per_mm, p.colour) for p in SOFT.points))
    physical = picture(volume_of(GRID), function=mapped, slope=slope, intercept=intercept)
    assert_same(picture(volume_of(GRID)), physical)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_voxel_that_is_not_finite_is_refused_with_its_place(value):
    volume = volume_of(GRID, np.float32)
    volume[3, 4, 5] = value
    with pytest.raises(VolprepError, match="z 3, y 4, x 5") as caught:
        picture(volume)
    assert caught.value.code == "VP6001"


def test_a_volume_that_is_not_the_grids_is_refused():
    with pytest.raises(ValueError, match="its grid"):
        picture(np.zeros((5, 6, 8), np.uint8))


def test_the_native_oracle_refuses_sizes_that_do_not_fit(oracle):
    camera = oracle.ray((0, 0, 0), (1, 0, 0), 1.0)
    volume = np.zeros((2, 2, 2), np.uint8)
    for wrong in ({"tolerance": 1e-14}, {"spacing_mm_xyz": (0, 1, 1)}, {"threads": -1}, {"extent_mm_xyz": (1, 1, 0)}):
        with pytest.raises(ValueError, match=r"must be|expected"):
            oracle.draw(volume, [oracle.point(0, 1.0)], camera, **wrong)
    with pytest.raises(ValueError, match="at least 1"):
        oracle.draw(volume, [], camera)
    with pytest.raises(TypeError):
        oracle.draw(volume.astype(np.float64), [oracle.point(0, 1.0)], camera)
