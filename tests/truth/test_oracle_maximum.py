"""The greatest value along a ray against closed forms, and against many samples along it."""

from itertools import product
from typing import NamedTuple

import closed_forms
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from volprep.kernels import _native
from volprep.truth import phantoms
from volprep_formats.grid import Grid

EPSILON = np.finfo(float).eps
DTYPES = [np.uint8, np.int16, np.uint16, np.float32]
DIRECTIONS = [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 1, 0), (1, 1, 1), (-0.3, 0.7, 0.2), (1, 1e-9, 0), (2, -1, 1e-3)]


class Found(NamedTuple):
    value: np.ndarray
    bound: np.ndarray


def greatest(volume, camera, *, spacing=(1.0, 1.0, 1.0), slope=1.0, intercept=0.0, shape_hw=(1, 1), **options):
    """The native kernel. The whole volume is the box; one thread, unless told otherwise."""
    spacing = tuple(float(length) for length in spacing)
    extent = tuple(options.get("extent", np.array(volume.shape[::-1]) * spacing))
    # inf shows a pixel that nobody wrote.
    found = Found(np.full(shape_hw, np.inf), np.full(shape_hw, np.inf))
    threads = options.get("threads", 1)
    _native.render_projection(volume, slope, intercept, spacing, extent, camera, "maximum", *found, threads=threads)
    return found


def assert_is(found, truth, span):
    """`span` is how much the voxels differ: a bound is useless unless it is far below."""
    assert found.bound[0, 0] <= 1e-12 * span + 8 * EPSILON * abs(truth)
    assert abs(found.value[0, 0] - truth) <= found.bound[0, 0] + 8 * EPSILON * (abs(truth) + span)


def slow_greatest(oracle, volume, ray_mm, spacing, samples=10_000):
    """The greatest of many samples of a ray (origin, direction, length), and how much the true maximum may be above."""
    origin, direction, length = np.array(ray_mm[0], float), np.array(ray_mm[1], float), ray_mm[2]
    direction /= np.linalg.norm(direction)
    values = volume.astype(float)
    start, end = oracle.inside_box(origin, direction, length, np.array(volume.shape[::-1]) * spacing)
    if start >= end:
        return np.nan, 0.0
    places = np.linspace(start, end, samples)
    found = oracle.trilinear(values, origin + np.multiply.outer(places, direction), spacing).max()
    steepest = np.ptp(values) * np.sum(np.abs(direction) / spacing)
    return found, steepest * (end - start) / (samples - 1) / 2


def assert_agrees_with_samples(oracle, volume, ray_mm, spacing):
    found = greatest(volume, oracle.ray(*ray_mm), spacing=spacing)
    sample, above = slow_greatest(oracle, volume, ray_mm, np.array(spacing))
    if np.isnan(sample):
        assert np.isnan(found.value[0, 0])
        assert found.bound[0, 0] == 0.0
        return
    span = np.ptp(volume.astype(float))
    rounding = 1e-12 * (span + abs(sample))
    assert sample <= found.value[0, 0] + found.bound[0, 0] + rounding
    assert found.value[0, 0] <= sample + above + found.bound[0, 0] + rounding
    # Where a point is known to some units in the last place of the ray's size, and how steep the field may be there.
    size = max(ray_mm[2], *np.abs(ray_mm[0]), *(np.array(volume.shape[::-1]) * spacing))
    assert found.bound[0, 0] <= 20 * EPSILON * (span * (4 + np.sum(size / np.array(spacing))) + abs(volume).max())


def to_centre(extent, direction):
    """A ray through the middle of the box that begins and ends outside."""
    direction = np.array(direction) / np.linalg.norm(direction)
    reach = 2 * np.linalg.norm(extent)
    return np.array(extent) / 2 - direction * reach, direction, 2 * reach


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_ramp_is_greatest_at_one_end_of_the_ray(oracle, direction):
    spacing = np.array([0.5, 2.0, 1.25])
    shape_zyx = (9, 6, 17)
    extent = np.array(shape_zyx[::-1]) * spacing
    field = closed_forms.ramp((0.25, -0.125, 0.5), 3.0)
    volume = phantoms.sampled(field, Grid.of(shape_zyx, tuple(spacing[::-1])))
    # From one outer plane of voxel centres to another: beyond them the field is not a ramp any more.
    direction = np.array(direction) / np.linalg.norm(direction)
    reach = np.min(np.divide((extent - spacing) / 2, np.abs(direction), where=direction != 0, out=np.full(3, np.inf)))
    origin = extent / 2 - direction * reach
    truth = field(np.array([origin, origin + 2 * reach * direction])).max()
    assert_is(greatest(volume, oracle.ray(origin, direction, 2 * reach), spacing=spacing), truth, np.ptp(volume))


@pytest.mark.parametrize("direction", [(1, 1, 0), (1, 2, 0), (3, 1, 0.5), (1, 0.2, -0.3)])
def test_a_quadratic_bowl_is_greatest_at_its_rim_and_a_dome_at_its_top(oracle, direction):
    # (x - 4)(y - 4) is trilinear, so that the field is the same in all cells: along a rising ray it is a bowl, and its
    # negative a dome.
    z, y, x = np.meshgrid(*[np.arange(n) + 0.5 for n in (5, 8, 8)], indexing="ij")
    bowl = ((x - 4) * (y - 4) + 0 * z).astype(np.float32)
    direction = np.array(direction) / np.linalg.norm(direction)
    origin, length = np.array([4.25, 3.5, 2.5]) - 2.5 * direction, 5.0
    offset = origin[:2] - 4
    t = np.array([0, length, -(direction[:2] @ offset[::-1]) / (2 * direction[0] * direction[1])])
    values = (offset[0] + t * direction[0]) * (offset[1] + t * direction[1])
    assert 0 < t[2] < length
    assert_is(greatest(bowl, oracle.ray(origin, direction, length)), values[:2].max(), np.ptp(bowl))
    assert_is(greatest(-bowl, oracle.ray(origin, direction, length)), -values[2], np.ptp(bowl))


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("corner", list(product([-1, 1], repeat=3)))
def test_one_bright_voxel_passed_at_a_corner_has_its_greatest_value_inside_a_cell(oracle, dtype, corner):
    # Along (s, s, 1 - s) of the cell the field is 108 (1 - s)² s: 16 at s = 1/3, and 0 at both ends.
    volume = np.zeros((5, 5, 5), dtype)
    volume[2, 2, 2] = 108
    centre = np.array([2.5, 2.5, 2.5])
    start, end = centre + corner * np.array([-1.0, -1.0, 2.0]), centre + corner * np.array([2.0, 2.0, -1.0])
    found = greatest(volume, oracle.ray(start, end - start, np.linalg.norm(end - start)))
    assert_is(found, 16.0, 108)


def test_a_cubic_through_many_cells_is_greatest_where_its_slope_is_zero(oracle):
    z, y, x = np.meshgrid(*[np.arange(12) + 0.5 for _ in range(3)], indexing="ij")
    volume = ((x - 3) * (y - 6) * (z - 8)).astype(np.float32)
    direction = np.array([1.0, 0.8, 0.9]) / np.linalg.norm([1.0, 0.8, 0.9])
    origin, length = np.array([0.75, 2.0, 1.0]), 12.0
    cubic = np.poly1d([1.0])
    for axis, zero in enumerate((3, 6, 8)):
        cubic *= np.poly1d([direction[axis], origin[axis] - zero])
    places = [root.real for root in cubic.deriv().roots if 0 < root.real < length]
    assert len(places) == 2
    truth = max(cubic(np.array([0, length, *places])))
    assert truth > max(cubic(0), cubic(length))
    assert_is(greatest(volume, oracle.ray(origin, direction, length)), truth, np.ptp(volume))


@settings(max_examples=150)
@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(*[st.integers(1, 19)] * 3),
    axis=st.sampled_from([None, None, 0, 1, 2]),
    dtype=st.sampled_from(DTYPES),
    sparse=st.booleans(),
)
def test_ten_thousand_samples_never_exceed_the_maximum_and_come_near_it(  # noqa: PLR0917
    oracle, seed, shape, axis, dtype, sparse
):
    rng = np.random.default_rng(seed)
    spacing = rng.choice([0.01, 0.3, 1.0, 1.7], 3)
    volume = rng.integers(0, 256, shape).astype(dtype)
    if sparse:
        volume[rng.random(shape) < 0.95] = 7
    extent = np.array(shape[::-1]) * spacing
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0, 1, 3) * extent
    if axis is not None:
        target[axis] = origin[axis]  # parallel to two faces
    length = np.linalg.norm(target - origin) * rng.uniform(0.5, 3)
    assert_agrees_with_samples(oracle, volume, (origin, target - origin, length), spacing)


SPECIAL_RAYS = {
    "along an axis through voxels": ((-1, 2.5, 1.5), (1, 0, 0)),
    "along an axis between them": ((-1, 2.2, 1.9), (1, 0, 0)),
    "in a face between cells": ((-1, 2.5, 0.3), (1, 0, 0.31)),
    "in a face, against the axis": ((1.5, 6.0, 0.2), (0, -1, 0.4)),
    "through corners of cells": ((-0.5, -0.5, -0.5), (1, 1, 1)),
    "through corners, backwards": ((5.5, 5.5, 5.5), (-1, -1, -1)),
    "across the diagonals of faces": ((-0.5, 2.5, -0.5), (1, 0, 1)),
    "nearly in a face": ((-1, 2.5, 1.5), (1, 1e-13, -1e-9)),
    "along the box's surface": ((-1, 0, 0), (1, 0, 0)),
    "along the far surface": ((-1, 5, 5), (1, 0, 0)),
    "in the outer half voxel": ((-1, 0.2, 4.9), (1, 0, 0)),
    "from inside": ((2.2, 2.9, 1.1), (-0.2, 0.5, 0.7)),
    "past the box": ((-1, 5.001, 2), (1, 0, 0)),
    "away from the box": ((-1, 2, 2), (-1, 0.1, 0)),
}


@pytest.mark.parametrize(("origin", "direction"), SPECIAL_RAYS.values(), ids=SPECIAL_RAYS)
def test_rays_along_axes_in_faces_and_past_the_box_agree_with_samples(oracle, origin, direction):
    volume = np.random.default_rng(7).integers(0, 256, (5, 5, 5)).astype(np.uint8)
    assert_agrees_with_samples(oracle, volume, (origin, direction, 12.0), (1.0, 1.0, 1.0))


def test_a_ray_that_touches_one_corner_of_the_box_misses_it_or_has_its_value(oracle):
    volume = np.random.default_rng(7).integers(1, 256, (5, 5, 5)).astype(np.uint8)
    for shift in np.linspace(-1e-15, 1e-15, 21):
        found = greatest(volume, oracle.ray((-1, 0.01 + shift, 0), (1, -0.01, 0), 12))
        assert np.isnan(found.value[0, 0]) or found.value[0, 0] == volume[0, 0, 0]
    assert np.isnan(greatest(volume, oracle.ray((-1, 0.0099, 0), (1, -0.01, 0), 12)).value[0, 0])


def test_a_ray_along_voxel_centres_has_their_greatest_value_exactly(oracle):
    volume = np.random.default_rng(3).integers(-500, 500, (3, 7, 40)).astype(np.int16)
    for y in range(7):
        found = greatest(volume, oracle.ray((-1, y + 0.5, 1.5), (1, 0, 0), 50))
        assert found.value[0, 0] == volume[1, y].max()


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 1, 9), (9, 1, 1), (1, 7, 1), (2, 1, 5), (1, 3, 4), (1, 17, 1)])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0, -1), (0.4, 1, 0.7)])
def test_axes_of_one_voxel_work(oracle, shape, direction):
    volume = np.random.default_rng(3).integers(0, 256, shape).astype(np.int16)
    spacing = np.array([0.8, 3.0, 1.1])
    extent = np.array(shape[::-1]) * spacing
    assert_agrees_with_samples(oracle, volume, to_centre(extent, direction), spacing)


@pytest.mark.parametrize("spacing", [(0.01, 1, 1), (1, 0.01, 1), (1, 1, 100)])
@pytest.mark.parametrize("target", [(0.3, 0.4, 0.6), (0.5, 0.5, 0.5), (0.9, 0.1, 0.2)])
def test_spacing_of_one_to_a_hundred_works(oracle, spacing, target):
    volume = np.random.default_rng(5).integers(0, 256, (4, 5, 7)).astype(np.uint16)
    extent = np.array([7, 5, 4]) * spacing
    origin = extent * (1.1, 1.2, -0.2)
    direction = extent * target - origin
    ray_mm = (origin, direction, 2 * np.linalg.norm(direction))
    assert_agrees_with_samples(oracle, volume, ray_mm, np.array(spacing, float))


@pytest.mark.parametrize("shape", [(19, 33, 26), (1, 40, 9), (17, 17, 17), (8, 9, 10)])
@pytest.mark.parametrize("direction", [(0, 0, 1), (-1, 0, 0), (1, 1, 1), (-0.6, 0.9, 0.35)])
def test_blocks_that_are_left_out_lose_nothing(oracle, shape, direction):
    # A few bright voxels of many heights, just beyond the face of a block of 8 or in a corner.
    rng = np.random.default_rng(9)
    volume = rng.uniform(0, 10, shape).astype(np.float32)
    for _ in range(40):
        at = tuple(rng.choice([i for i in (0, 1, 7, 8, 9, 15, 16, 17, 25, n - 1) if i < n]) for n in shape)
        volume[at] = rng.uniform(10, 100)
    extent = np.array(shape[::-1], float)
    for _ in range(8):
        origin, unit, length = to_centre(extent, direction)
        shift = rng.uniform(-0.4, 0.4, 3) * extent
        assert_agrees_with_samples(oracle, volume, (origin + shift, unit, length), (1.0, 1.0, 1.0))


def turned(shape, zoom=1.0):
    """A camera on the box that looks along an oblique direction, at a scale that float64 does not hold exactly."""
    rng = np.random.default_rng(4)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    extent = np.array(shape[::-1], float)
    camera = np.eye(4)
    camera[:3, :3] = rotation * np.linalg.norm(extent) * 0.6 * zoom
    camera[:3, 3] = extent / 2
    return camera


BEHIND = np.diag([-1.0, 1.0, -1.0, 1.0])


def test_the_view_from_behind_is_the_mirrored_picture(oracle):
    volume = np.random.default_rng(6).integers(0, 256, (11, 20, 17)).astype(np.uint8)
    front = greatest(volume, turned(volume.shape), shape_hw=(23, 31))
    back = greatest(volume, turned(volume.shape) @ BEHIND, shape_hw=(23, 31))
    mirrored = Found(*(each[:, ::-1] for each in back))
    np.testing.assert_array_equal(np.isnan(front.value), np.isnan(mirrored.value))
    hit = ~np.isnan(front.value)
    assert 100 < hit.sum() < hit.size
    assert (np.abs(front.value - mirrored.value)[hit] <= (front.bound + mirrored.bound)[hit]).all()
    assert np.unique(front.value[hit]).size > 50


def test_the_view_from_behind_is_exactly_the_mirrored_picture_along_an_axis(oracle):
    volume = np.random.default_rng(6).integers(0, 256, (16, 8, 32)).astype(np.uint8)
    camera = np.diag([16.0, 4.0, 8.0, 1.0])
    camera[:3, 3] = (16.0, 4.0, 8.0)
    front = greatest(volume, camera, shape_hw=(16, 64))
    back = greatest(volume, camera @ BEHIND, shape_hw=(16, 64))
    np.testing.assert_array_equal(front.value, back.value[:, ::-1])
    assert np.unique(front.value).size > 50


def test_the_maximum_of_a_ray_is_the_greater_one_of_its_two_halves(oracle):
    volume = np.random.default_rng(8).integers(0, 1000, (9, 20, 17)).astype(np.uint16)
    whole = turned(volume.shape)
    parts = []
    for side in (-1.0, 1.0):
        half = np.diag([1.0, 1.0, 0.5, 1.0])
        half[2, 3] = side * 0.5
        parts.append(greatest(volume, whole @ half, shape_hw=(20, 20)))
    found = greatest(volume, whole, shape_hw=(20, 20))
    both = np.fmax(parts[0].value, parts[1].value)
    np.testing.assert_array_equal(np.isnan(found.value), np.isnan(both))
    np.testing.assert_allclose(found.value, both, atol=1e-9)
    assert (parts[0].value < parts[1].value).any()
    assert (parts[0].value > parts[1].value).any()


@pytest.mark.parametrize("dtype", DTYPES)
def test_each_voxel_type_gives_the_same_maximum(oracle, dtype):
    volume = np.random.default_rng(8).integers(0, 256, (9, 20, 17))
    truth = greatest(volume.astype(np.float32), turned(volume.shape), shape_hw=(12, 12))
    found = greatest(volume.astype(dtype), turned(volume.shape), shape_hw=(12, 12))
    np.testing.assert_array_equal(found.value, truth.value)


def test_with_a_negative_slope_the_least_stored_value_wins(oracle):
    volume = np.random.default_rng(8).integers(0, 256, (9, 20, 17)).astype(np.uint8)
    found = greatest(volume, turned(volume.shape), shape_hw=(12, 12), slope=-2.0, intercept=100.0)
    physical = (-2.0 * volume + 100.0).astype(np.float32)
    np.testing.assert_array_equal(found.value, greatest(physical, turned(volume.shape), shape_hw=(12, 12)).value)
    assert np.nanmax(found.value) > -100.0  # the greatest stored values would give about -400


def test_slope_and_intercept_are_applied(oracle):
    volume = np.random.default_rng(8).integers(0, 256, (9, 20, 17)).astype(np.uint8)
    stored = greatest(volume, turned(volume.shape), shape_hw=(12, 12))
    found = greatest(volume, turned(volume.shape), shape_hw=(12, 12), slope=0.25, intercept=-1024.0)
    np.testing.assert_allclose(found.value, 0.25 * stored.value - 1024.0, rtol=1e-13)


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), by=st.integers(1, 100))
def test_a_brighter_voxel_never_lowers_the_maximum_and_none_exceeds_the_brightest(oracle, seed, by):
    rng = np.random.default_rng(seed)
    volume = rng.integers(0, 100, rng.integers(1, 12, 3)).astype(np.uint8)
    before = greatest(volume, turned(volume.shape), shape_hw=(6, 6))
    volume[tuple(rng.integers(0, volume.shape))] += by
    after = greatest(volume, turned(volume.shape), shape_hw=(6, 6))
    hit = ~np.isnan(before.value)
    assert hit.any()
    assert (after.value[hit] >= (before.value - before.bound - after.bound)[hit]).all()
    assert after.value[hit].max() <= volume.max()
    assert before.value[hit].min() >= 0


def test_a_field_of_one_value_is_known_exactly(oracle):
    found = greatest(np.full((9, 20, 17), 0.1, np.float32), turned((9, 20, 17)), shape_hw=(12, 12), intercept=1e6)
    hit = ~np.isnan(found.value)
    assert (found.value[hit] == 1e6 + float(np.float32(0.1))).all()
    assert (found.bound == 0.0).all()


def test_the_bound_near_one_block_does_not_depend_on_what_is_far_away(oracle):
    volume = np.zeros((9, 9, 60), np.float32)
    volume[:, :, :9] = np.random.default_rng(1).uniform(0, 1, (9, 9, 9))
    volume[:, :, -1] = 1e30
    found = greatest(volume, oracle.ray((4.2, 4.3, -1), (0.01, 0.02, 1), 20))
    assert 0 < found.bound[0, 0] < 1e-12


def test_a_box_smaller_than_its_voxels_ends_the_ray(oracle):
    volume = np.arange(10, dtype=np.float32)[None, None, :].repeat(3, axis=0).repeat(3, axis=1)
    found = greatest(volume, oracle.ray((-1, 1.5, 1.5), (1, 0, 0), 20), extent=(6.25, 3.0, 3.0))
    assert_is(found, 5.75, 9)


def test_pictures_do_not_depend_on_threads(oracle):
    volume = np.random.default_rng(8).integers(0, 256, (9, 20, 17)).astype(np.uint8)
    one = greatest(volume, turned(volume.shape), shape_hw=(40, 40), threads=1)
    two = greatest(volume, turned(volume.shape), shape_hw=(40, 40), threads=2)
    np.testing.assert_array_equal(one.value, two.value)
    np.testing.assert_array_equal(one.bound, two.bound)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bound": np.empty((2, 3))}, "value and bound must have the same height and width"),
        ({"spacing_mm_xyz": (1.0, 0.0, 1.0)}, "must be above 0"),
        ({"volume": np.empty((0, 2, 2), np.uint8)}, "at least one voxel along each axis"),
        ({"threads": -1}, "threads is -1"),
        ({"projection": "median"}, "maximum or average"),
    ],
)
def test_sizes_that_do_not_fit_are_refused(change, message):
    given_ = {
        "volume": np.zeros((2, 2, 2), np.uint8),
        "slope": 1.0,
        "intercept": 0.0,
        "spacing_mm_xyz": (1.0, 1.0, 1.0),
        "extent_mm_xyz": (2.0, 2.0, 2.0),
        "box_from_clip": np.eye(4),
        "projection": "maximum",
        "value": np.empty((2, 2)),
        "bound": np.empty((2, 2)),
    }
    with pytest.raises(ValueError, match=message):
        _native.render_projection(**(given_ | change))


def test_other_voxel_types_are_refused():
    with pytest.raises(TypeError, match="volume is float64, expected uint8"):
        greatest(np.zeros((2, 2, 2)), np.eye(4))
