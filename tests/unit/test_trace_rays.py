"""The lit light of rays against samples and gradients in numpy, and its adjoint against differences of the light."""

import numpy as np
import pytest
from adjoint_rays import SHAPE, SLOPES, SPACING, TABLE, random_lines
from scipy import ndimage

from volprep.compositing import COMPOSITINGS
from volprep.kernels import _native
from volprep.parts.levels.rays import RaySegments, ray_counts, sample_level
from volprep.parts.levels.traced import order_in_space
from volprep.scan.in_memory import InMemory
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

HALVED_ZYX = (True, False, True)
SOFT_PER_MM = 1e-3


@pytest.fixture
def codes():
    return np.random.default_rng(1).integers(12000, 52000, SHAPE).astype(np.uint16)


@pytest.fixture
def lines():
    return random_lines()


def arguments(lines):
    """Rays and shading as both kernels take them."""
    spacing = np.array(SPACING[::-1])
    counts = ray_counts(lines.lengths_mm, SPACING, per_voxel=3)
    apart = np.where(HALVED_ZYX[::-1], 0.5, 1.0)
    rays = (lines.starts_mm_xyz / spacing - 0.5, lines.directions_xyz / spacing, lines.lengths_mm)
    return *rays, np.concatenate([[0], np.cumsum(counts)]), (*spacing, *apart, SOFT_PER_MM), TABLE


def light_of(codes, lines, threads=0):
    light = np.empty((len(lines.lengths_mm), 4))
    _native.trace_light(codes, 1.0 / 65535, *arguments(lines), light, None, threads)
    return light


def sums_of(codes, lines, light, threads=0):
    sums = np.zeros((*SHAPE, 2), np.float32)
    room = np.zeros(_native.trace_room(SHAPE), np.float32)
    level = (codes / 65535).astype(np.float32)
    return _native.trace_sums(level, *arguments(lines), SLOPES, light, np.ones(len(light)), room, sums, threads), sums


def cosines_of(codes, lines, offsets):
    """Cosines of rays and gradients; those in the outer half voxels are of the outer voxels, as in shaders."""
    counts = np.diff(offsets)
    along_mm = (np.arange(offsets[-1]) - np.repeat(offsets[:-1], counts) + 0.5) * np.repeat(
        lines.lengths_mm / counts, counts
    )
    starts, directions = (np.repeat(each, counts, axis=0) for each in (lines.starts_mm_xyz, lines.directions_xyz))
    places_zyx = ((starts + along_mm[:, None] * directions) / SPACING[::-1] - 0.5)[:, ::-1]
    assert (places_zyx < 0).any()
    places_zyx = np.clip(places_zyx, 0, np.array(SHAPE) - 1)
    slopes = []
    for axis, (halved, spacing_mm) in enumerate(zip(HALVED_ZYX, SPACING, strict=True)):
        apart = np.eye(3)[axis] * (0.5 if halved else 1.0)
        above, below = (
            ndimage.map_coordinates(codes / 65535, (places_zyx + side * apart).T, order=1, mode="nearest")
            for side in (1, -1)
        )
        slopes.append((above - below) / (2 * apart[axis] * spacing_mm))
    along = (np.array(slopes[::-1]).T * directions).sum(axis=1)
    return np.hypot(along, SOFT_PER_MM) / np.hypot(np.linalg.norm(slopes, axis=0), SOFT_PER_MM)


def test_the_light_is_that_of_samples_and_their_gradients(codes, lines) -> None:
    along = sample_level(InMemory.of(codes), SPACING, lines, per_voxel=3)
    cosines = cosines_of(codes, lines, along.offsets)
    assert 0.1 < cosines.mean() < 0.9
    values = np.linspace(0.0, 1.0, len(TABLE))
    points = (
        TransferPoint(value=float(value), colour=tuple(entry[:3].tolist()), extinction_per_mm=float(entry[3]))
        for value, entry in zip(values, TABLE, strict=True)
    )
    table = Table.exact(TransferFunction(name="table", points=tuple(points)))
    lit_rays = COMPOSITINGS["emission-absorption"].lit_rays
    assert lit_rays is not None
    expected = [
        lit_rays(
            along.values[begin:end, None].astype(np.float64) / 65535,
            lines.lengths_mm[ray : ray + 1] / (end - begin),
            table,
            "nearest",
            cosines[begin:end, None],
        )[0]
        for ray, (begin, end) in enumerate(zip(along.offsets[:-1], along.offsets[1:], strict=True))
    ]
    assert light_of(codes, lines) == pytest.approx(np.array(expected), abs=2e-4)


def test_without_shading_the_light_is_that_of_samples(codes, lines) -> None:
    *rays, _, table = arguments(lines)
    light = np.empty((len(lines.lengths_mm), 4))
    _native.trace_light(codes, 1.0 / 65535, *rays, None, table, light)
    expected = sample_level(InMemory.of(codes), SPACING, lines, per_voxel=3).light(TABLE)
    # What lies behind a five-hundredth of the light is left out.
    assert light == pytest.approx(expected, abs=2.1e-3)
    assert np.abs(light - expected).mean() < 1e-3


def test_a_ray_shows_most_at_its_first_opaque_voxel() -> None:
    codes = np.zeros((9, 9, 40), np.uint16)
    codes[:, :, 21] = codes[:, :, 30] = 65535
    lines = RaySegments(np.array([[0.0, 4.5, 4.5]]), np.array([[1.0, 0.0, 0.0]]), np.array([40.0]))
    table = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 20.0]])
    rays = (lines.starts_mm_xyz - 0.5, lines.directions_xyz, lines.lengths_mm, np.array([0, 400]))
    depths_mm = np.empty(1)
    _native.trace_light(codes, 1.0 / 65535, *rays, None, table, np.empty((1, 4)), depths_mm)
    assert depths_mm[0] == pytest.approx(21.0, abs=0.5)
    _native.trace_light(np.zeros_like(codes), 1.0 / 65535, *rays, None, table, np.empty((1, 4)), depths_mm)
    assert depths_mm[0] == 20.0


def test_neighbours_in_space_follow_each_other() -> None:
    places_mm = np.random.default_rng(2).uniform(0.0, 50.0, (4000, 3))
    apart_mm = np.linalg.norm(np.diff(places_mm[order_in_space(places_mm, 50.0)], axis=0), axis=1)
    # By chance 33 mm; the nearest of so many is 1.7 mm away.
    assert np.median(apart_mm) < 4.0


def test_the_gradient_is_that_of_differences_of_the_light(codes, lines) -> None:
    target = light_of(np.full(SHAPE, 26000, np.uint16), lines)
    cost, sums = sums_of(codes, lines, target)
    assert cost == pytest.approx(((light_of(codes, lines) - target) ** 2).sum(), rel=1e-3)
    change = 50
    for voxel in [(0, 0, 0), (1, 2, 1), (2, 4, 3), (1, 3, 2)]:
        costs = []
        for sign in (1, -1):
            moved = codes.copy()
            moved[voxel] = int(codes[voxel]) + sign * change
            costs.append(((light_of(moved, lines) - target) ** 2).sum())
        slope = (costs[0] - costs[1]) / (2 * change / 65535)
        assert 2 * sums[(*voxel, 0)] == pytest.approx(slope, rel=0.03, abs=2e-3 * float(np.abs(sums).max()))


def test_a_step_of_gradient_over_curvature_lowers_the_error(codes, lines) -> None:
    target = light_of(np.random.default_rng(5).integers(12000, 52000, SHAPE).astype(np.uint16), lines)
    cost, sums = sums_of(codes, lines, target)
    met = sums[..., 1] > 0
    step = np.where(met, sums[..., 0] / np.where(met, sums[..., 1], 1), 0)
    after, _ = sums_of(np.clip(codes - 65535 * step, 0, 65535), lines, target)
    assert 0 < after < 0.95 * cost


def test_threads_do_not_change_a_bit(codes, lines) -> None:
    target = light_of(codes, lines, threads=1)
    assert np.array_equal(target, light_of(codes, lines, threads=3))
    (cost, one), (again, three) = (sums_of(codes, lines, target[::-1].copy(), threads) for threads in (1, 3))
    assert cost == again
    assert np.array_equal(one, three)


def test_arguments_that_do_not_fit_are_refused(codes, lines) -> None:
    with pytest.raises(ValueError, match="a row for each ray"):
        sums_of(codes, lines, np.zeros((20, 4)))
    with pytest.raises(TypeError, match="src is float32"):
        light_of(codes.astype(np.float32), lines)


def test_rays_pass_empty_blocks_without_missing_a_sample() -> None:
    shape = (19, 22, 26)
    generator = np.random.default_rng(6)
    # Single bright voxels: many lie just behind the end of an empty block.
    codes = np.where(generator.random(shape) < 0.004, 65535, 0).astype(np.uint16)
    extent = np.array(shape[::-1]) * SPACING[::-1]
    starts, ends = generator.uniform(0, 1, (2, 4000, 3)) * extent
    # Along the axes, too, in both directions, and from the outer half voxels.
    ends[:60] = np.where(np.eye(3, dtype=bool)[np.arange(60) % 3], extent - starts[:60], starts[:60])
    lengths = np.linalg.norm(ends - starts, axis=1)
    lines = RaySegments(starts, (ends - starts) / lengths[:, None], lengths)
    *rays, table = arguments(lines)
    sparse = table * np.where(np.arange(len(table)) < 3, 0.0, 1.0)[:, None]
    faint = np.where(sparse > 0, sparse, 1e-12)
    lights = np.empty((2, 4000, 4))
    for light, each in zip(lights, (sparse, faint), strict=True):
        _native.trace_light(codes, 1.0 / 65535, *rays, each, light)
    assert 0.1 < (lights[0, :, 3] > 0.1).mean() < 0.9
    np.testing.assert_allclose(lights[0], lights[1], atol=1e-9)
