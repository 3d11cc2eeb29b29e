"""Where rays meet an isosurface, against closed forms and roots that numpy finds."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_builds import view_of
from tiny_packages import function

from volprep.truth.surface import directions, surface_hits, surface_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid

UNIT = (1.0, 1.0, 1.0)


def hits(volume, camera, isovalue, *, solid=False, spacing=UNIT, shape_hw=(1, 1), normals=None):
    grid = Grid.of(volume.shape, spacing[::-1])
    return surface_hits(Volume(volume, grid, normals=normals), isovalue, camera, shape_hw, solid=solid)


def cell_roots(oracle, volume, ray, planes, isovalue):
    """Where the field passes the isovalue: roots of the cubics between the planes, as numpy finds them."""
    origin, direction = ray
    places = np.array([-1.0, -0.4, 0.4, 1.0])
    found = []
    for low, high in pairwise(planes):
        middle, half = (low + high) / 2, (high - low) / 2
        at = origin + np.multiply.outer(middle + half * places, direction)
        cubic = np.linalg.solve(np.vander(places, 4), oracle.trilinear(volume, at, UNIT) - isovalue)
        roots = np.roots(cubic) if np.any(np.abs(cubic[:3]) > 1e-12) else []
        found += [middle + half * root.real for root in roots if abs(root.imag) < 1e-7 and abs(root.real) <= 1 + 1e-9]
    return sorted(found)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_place_is_the_first_root_to_1e_9_of_a_cell(oracle, seed) -> None:
    rng = np.random.default_rng(seed)
    volume = rng.uniform(0, 1, (6, 7, 8))
    volume[:, :2] *= 0.3
    volume = volume.astype(np.float32)
    direction = np.array([rng.uniform(-0.4, 0.4), 1.0, rng.uniform(-0.4, 0.4)])
    direction /= np.linalg.norm(direction)
    origin = np.array([4.0, 3.5, 3.0]) + rng.uniform(-0.3, 0.3, 3) - 5 * direction
    start, end = oracle.inside_box(origin, direction, 12.0, np.array(volume.shape[::-1], float))
    planes = {start, end}
    for axis in range(3):
        t = (np.arange(volume.shape[2 - axis]) + 0.5 - origin[axis]) / direction[axis]
        planes |= set(t[(t > start) & (t < end)].tolist())
    roots = cell_roots(oracle, volume.astype(float), (origin, direction), sorted(planes), 0.5)
    found = hits(volume, oracle.ray(origin, direction, 12.0), 0.5)
    if not roots:
        assert np.isnan(found.t_mm[0, 0])
    elif np.isfinite(found.error_mm[0, 0]):
        assert abs(found.t_mm[0, 0] - roots[0]) < 1e-9 + found.error_mm[0, 0]
        assert found.error_mm[0, 0] < 1e-9


@pytest.mark.parametrize("radius", [7.0, 9.3])
def test_a_sphere_is_where_it_is_within_the_bound_of_its_interpolation(radius) -> None:
    spacing = (0.8, 1.0, 1.25)
    shape = (24, 28, 33)
    grid = Grid.of(shape, spacing[::-1])
    extent = np.array(grid.extent_mm_zyx[::-1])
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) * h for n, h in zip(shape, spacing[::-1], strict=True)), indexing="ij")
    distance = np.linalg.norm(np.stack([x, y, z], axis=-1) - extent / 2, axis=-1).astype(np.float32)
    matrix = view_of(grid, "anterior-left")
    found = surface_hits(Volume(distance, grid), radius, matrix, (40, 40), solid=False)
    met = np.isfinite(found.t_mm)
    assert met.sum() > 80
    near = matrix @ np.array([0.0, 0.0, -1.0, 1.0])
    assert near[3] == 1.0
    row, column = np.nonzero(met)
    clip = np.stack([(2 * column + 1) / 40 - 1, 1 - (2 * row + 1) / 40, np.full(len(row), -1.0), np.ones(len(row))])
    origin = (matrix @ clip)[:3].T
    at = origin + found.t_mm[met][:, None] * directions(matrix, (40, 40))[met]
    # Linear interpolation along an axis misses a second derivative of at most 1 / r by h² / 8 of it.
    bound = sum(h**2 for h in spacing) / 8 / (radius - np.linalg.norm(spacing))
    assert np.abs(np.linalg.norm(at - extent / 2, axis=-1) - radius).max() <= bound


def test_a_ray_from_inside_meets_the_surface_at_its_exit_and_the_solid_at_once(oracle) -> None:
    volume = np.arange(10, 0, -1, dtype=np.uint8)[None, None, :].repeat(3, axis=0).repeat(3, axis=1)
    camera = oracle.ray((0.0, 1.5, 1.5), (1, 0, 0), 20)
    open_box = hits(volume, camera, 4.25)
    assert abs(open_box.t_mm[0, 0] - 6.25) < 1e-12
    assert open_box.value[0, 0] == 4.25
    solid = hits(volume, camera, 4.25, solid=True)
    assert solid.t_mm[0, 0] == 0.0
    assert solid.value[0, 0] == 10.0


def test_a_surface_that_is_only_touched_says_that_it_cannot_tell(oracle) -> None:
    volume = np.zeros((3, 3, 9), np.float32)
    volume[1, 1, 4] = 1.0
    found = hits(volume, oracle.ray((-1, 1.5, 1.5), (1, 0, 0), 20), 1.0)
    assert np.isinf(found.error_mm[0, 0]) or abs(found.t_mm[0, 0] - 5.5) < 1e-9
    below = hits(volume, oracle.ray((-1, 1.5, 1.5), (1, 0, 0), 20), 1.001)
    assert np.isnan(below.t_mm[0, 0])
    assert below.error_mm[0, 0] == 0.0


@pytest.mark.parametrize("shape", [(1, 1, 9), (17, 18, 25), (2, 9, 8)])
def test_blocks_that_are_left_out_hide_no_surface(oracle, shape) -> None:
    rng = np.random.default_rng(5)
    volume = np.zeros(shape, np.int16)
    volume[tuple(rng.integers(0, shape))] = 100
    grid = Grid.of(shape, UNIT)
    matrix = view_of(grid, "anterior-left")
    found = surface_hits(Volume(volume, grid), 40.0, matrix, (32, 32), solid=True)
    step, count = 0.01, 12_000
    along = directions(matrix, (32, 32))
    seen = 0
    for row, column in rng.integers(0, 32, (40, 2)):
        clip = np.array([(2 * column + 1) / 32 - 1, 1 - (2 * row + 1) / 32, -1.0, 1.0])
        t = np.arange(count) * step
        at = (matrix @ clip)[:3] + t[:, None] * along[row, column]
        inside = ((at >= 0) & (at <= np.array(shape[::-1]))).all(axis=1)
        above = inside & (oracle.trilinear(volume.astype(float), at, UNIT) >= 40.0)
        if above.any():
            seen += 1
            assert abs(found.t_mm[row, column] - t[above.argmax()]) <= step
    assert np.isfinite(found.t_mm).any()


def test_a_lit_sphere_is_as_bright_as_the_cosine_of_its_normals() -> None:
    grid = Grid.of((40, 40, 40), UNIT)
    z, y, x = np.meshgrid(*[np.arange(40) - 19.5] * 3, indexing="ij")
    distance = np.sqrt(x**2 + y**2 + z**2).astype(np.float32)
    normals = np.ascontiguousarray(np.stack([x, y, z], axis=-1) / distance[..., None], np.float32)
    white = function((0.0, (1.0, 1.0, 1.0), 5.0), (40.0, (1.0, 1.0, 1.0), 5.0)).model_copy(update={"isovalue": 15.0})
    matrix = view_of(grid, "anterior")
    picture = surface_picture(Volume(distance, grid, normals=normals), white, matrix, (60, 60), solid=False)
    at = ((np.arange(60) + 0.5) / 60 - 0.5) * np.linalg.norm(grid.extent_mm_zyx) / 15.0
    passes = np.hypot(at[:, None], at)
    inside = passes < 0.97
    cosine = np.sqrt(1 - np.minimum(passes, 1) ** 2)
    assert np.abs(picture.rgba[inside][:, 0] - cosine[inside] * (1 - np.exp(-5.0))).max() < 5e-3
    assert picture.bound[inside].max() < 1e-9
    assert (picture.rgba[passes > 1.01] == 0.0).all()


def test_a_transfer_function_without_an_isovalue_is_refused() -> None:
    with pytest.raises(ValueError, match="no isovalue"):
        surface_picture(
            Volume(np.zeros((2, 2, 2), np.uint8), Grid.of((2, 2, 2), UNIT)),
            function((0.0, (1.0, 1.0, 1.0), 1.0)),
            np.eye(4),
            (1, 1),
            solid=False,
        )
