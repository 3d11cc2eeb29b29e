"""The oracle with light from the viewer, against its slow twin and closed forms: within its bound, of known order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

TWIN_ROUNDING = 1e-11
KERNELS = ("forward", "central", "thesis", "sobel", "isotropic")
ACROSS = {"thesis": [[1, 3, 1], [3, 6, 3], [1, 3, 1]], "sobel": [[1, 2, 1], [2, 4, 2], [1, 2, 1]]}
ACROSS["isotropic"] = [[1, 4, 1], [4, 16, 4], [1, 4, 1]]


def unit_gradients(volume, kernel, spacing_xyz):
    """Normals [z, y, x, (x, y, z)] by shifting the padded volume."""
    values = np.pad(volume.astype(float), 1, mode="edge")
    across = np.array(ACROSS.get(kernel, [[0, 0, 0], [0, 1, 0], [0, 0, 0]]))
    slopes = []
    for axis in (2, 1, 0):
        n = volume.shape[axis]
        rows = np.moveaxis(values, axis, 0)
        if kernel == "forward":
            difference = rows[2:] - rows[1:-1]
            if n > 1:
                difference[-1] = rows[-2] - rows[-3]
        else:
            difference = rows[2:] - rows[:-2]
            difference[[0, -1]] *= 2
        total = sum(
            across[i, j] * difference[:, i : i + rows.shape[1] - 2, j : j + rows.shape[2] - 2]
            for i, j in np.ndindex(3, 3)
        )
        slopes.append(np.moveaxis(total, 0, axis) / spacing_xyz[2 - axis])
    vectors = np.stack(slopes, axis=-1)
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def random_scene(oracle, rng, scale):
    shape = tuple(rng.integers(1, 6, 3))
    volume = rng.integers(0, 256, shape).astype(rng.choice([np.uint8, np.int16, np.float32]))
    if rng.random() < 0.4:
        volume[rng.random(shape) < 0.6] = 200  # plateaus have no normal
    values = np.sort(rng.uniform(0, 255, rng.integers(1, 5)))
    points = [oracle.point(v, rng.uniform(0, scale), tuple(rng.uniform(0, 1, 3))) for v in values]
    return volume, rng.choice([0.3, 1.0, 1.7], 3), points


@settings(max_examples=10)
@given(
    seed=st.integers(0, 2**32 - 1),
    depth=st.floats(-2, 2).map(lambda power: 10.0**power),
    tolerance=st.floats(-8, -2).map(lambda power: 10.0**power),
    kernel=st.sampled_from(KERNELS),
    axis=st.sampled_from([None, None, 0, 1, 2]),
)
def test_random_rays_agree_within_the_bound(oracle, seed, depth, tolerance, kernel, axis):  # noqa: PLR0917
    rng = np.random.default_rng(seed)
    volume, spacing, points = random_scene(oracle, rng, depth)
    extent = np.array(volume.shape[::-1]) * spacing
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0, 1, 3) * extent
    if axis is not None:
        target[axis] = origin[axis]
    length = np.linalg.norm(target - origin) * 2
    camera = oracle.ray(origin, target - origin, length)
    answer = oracle.draw(volume, points, camera, spacing_mm_xyz=spacing, tolerance=tolerance, kernel=kernel)
    normals = unit_gradients(volume, kernel, spacing)
    truth = oracle.slow_light(volume, points, (origin, target - origin, length), spacing, normals)
    assert answer.bound[0, 0] <= tolerance
    assert np.abs(answer.rgba[0, 0] - truth).max() <= answer.bound[0, 0] + TWIN_ROUNDING


SPACING = (0.8, 1.0, 1.5)


def view(shape_zyx, eye=(-0.7, 0.5, 0.6)):
    """Parallel rays of [H, W] pixels through the middle of a volume, at an angle to all axes."""
    extent = np.array(shape_zyx[::-1]) * SPACING
    forward = np.array(eye) / np.linalg.norm(eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    camera, size = np.eye(4), np.linalg.norm(extent)
    camera[:3, :3] = np.column_stack([right, np.cross(right, forward), forward]) * size / 2
    camera[:3, 3] = extent / 2
    return camera


def phantom(shape=(13, 12, 15), seed=3):
    """Smooth hills with a plateau cut into them."""
    at = np.meshgrid(*[np.linspace(-1, 1, n) for n in shape], indexing="ij")
    noise = np.random.default_rng(seed).normal(0, 2, shape)
    field = 220 * np.exp(-2 * (at[0] ** 2 + at[1] ** 2 + 2 * at[2] ** 2)) + noise
    return np.clip(field, 20, 150).astype(np.uint8)


def lit(oracle, volume, points, camera, **options):
    return oracle.draw(volume, points, camera, spacing_mm_xyz=SPACING, shape_hw=(24, 24), **options)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_ramp_has_one_normal_and_so_one_shade(oracle, kernel):
    volume = np.broadcast_to(10 * np.arange(9, dtype=np.int16), (5, 6, 9)).copy()
    points = [oracle.point(5, 0.0), oracle.point(30, 2.0, (0.2, 0.9, 0.4)), oracle.point(80, 0.1, (1.0, 0.1, 0.3))]
    camera = view(volume.shape)
    plain = lit(oracle, volume, points, camera)
    found = lit(oracle, volume, points, camera, kernel=kernel)
    cosine = camera[0, 2] / np.linalg.norm(camera[:3, 2])
    shade = np.hypot(cosine, 0.01) / np.hypot(1.0, 0.01)
    error = np.abs(found.rgba[..., :3] - shade * plain.rgba[..., :3])
    assert (error <= (found.bound + plain.bound)[..., None]).all()
    np.testing.assert_allclose(found.rgba[..., 3], plain.rgba[..., 3], atol=2e-6)
    assert found.rgba[..., 1].max() > 0.3


def test_what_has_no_gradient_keeps_its_colour(oracle):
    volume = np.full((4, 5, 6), 70, np.uint8)
    points = [oracle.point(0, 0.1, (1.0, 0.0, 0.0)), oracle.point(100, 0.9, (0.0, 1.0, 0.5))]
    found = lit(oracle, volume, points, view(volume.shape), kernel="sobel")
    np.testing.assert_array_equal(found.rgba, lit(oracle, volume, points, view(volume.shape)).rgba)


def test_the_error_of_every_pixel_is_within_its_bound_and_that_within_the_tolerance(oracle):
    volume = phantom()
    points = [oracle.point(40, 0.0), oracle.point(90, 1.5, (0.9, 0.5, 0.2)), oracle.point(149, 6.0, (0.3, 0.6, 1.0))]
    camera = view(volume.shape)
    truth = lit(oracle, volume, points, camera, tolerance=1e-11, kernel="thesis")
    assert truth.bound.max() <= 1e-9
    for tolerance in (1e-2, 1e-4, 1e-6, 1e-8):
        found = lit(oracle, volume, points, camera, tolerance=tolerance, kernel="thesis")
        error = np.abs(found.rgba - truth.rgba).max(axis=-1)
        assert (error <= found.bound + truth.bound).all()
        assert found.bound.max() <= tolerance
        assert error.max() > tolerance * 1e-4  # it stops where it may


def test_given_normals_count_as_those_of_the_kernel(oracle):
    volume = phantom()
    points = [oracle.point(40, 0.0), oracle.point(149, 3.0, (0.3, 0.6, 1.0))]
    camera = view(volume.shape, (0.2, 0.9, -0.4))
    for kernel in ("forward", "isotropic"):
        normals = unit_gradients(volume, kernel, SPACING).astype(np.float32)
        found = lit(oracle, volume, points, camera, normals=normals, tolerance=1e-9)
        expected = lit(oracle, volume, points, camera, kernel=kernel, tolerance=1e-9)
        # A vector of float32, as short as 0.01 between voxels, turns by 1e-5 at most.
        np.testing.assert_allclose(found.rgba, expected.rgba, atol=1e-5)
        unlit = lit(oracle, volume, points, camera, tolerance=1e-9)
        assert np.abs(found.rgba - unlit.rgba).max() > 0.2
        assert (found.rgba[..., :3] <= unlit.rgba[..., :3] + 1e-9).all()


def test_normals_have_the_shape_of_the_volume(oracle):
    volume = phantom()
    points = [oracle.point(40, 1.0)]
    with pytest.raises(ValueError, match="normals has shape"):
        lit(oracle, volume, points, view(volume.shape), normals=np.zeros((1, 2, 3, 3), np.float32))
    with pytest.raises(ValueError, match="kernel is scharr"):
        lit(oracle, volume, points, view(volume.shape), kernel="scharr")
