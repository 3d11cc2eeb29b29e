"""The native samples of rays that patches throw back, against NumPy: the same bits."""

from itertools import product

import numpy as np
import pytest

from volprep.kernels import _native


def slow(patches, starts, velocities, step_mm, samples):
    """Throw each place back into the patch, and mix the eight voxels around it."""
    values = np.empty((samples, len(starts)))
    shape = np.array(patches.shape[1:])
    at_mm = (np.arange(samples) + 0.5) * step_mm
    for ray, (start, velocity) in enumerate(zip(starts, velocities, strict=True)):
        patch = patches[ray % len(patches)]
        places = start + velocity * at_mm[:, None]
        inside = shape - np.abs(shape - (places - 2 * shape * np.floor(places / (2 * shape))))
        centred = np.clip(inside - 0.5, 0, shape - 1)
        lower = np.minimum(centred.astype(int), np.maximum(shape - 2, 0))
        upper = np.minimum(lower + 1, shape - 1)
        share = centred - lower
        corners = {at: patch[tuple(np.where(at, upper, lower).T)] for at in product((False, True), repeat=3)}
        for axis in (2, 1, 0):
            near = {at[:axis]: voxels for at, voxels in corners.items() if not at[axis]}
            far = {at[:axis]: voxels for at, voxels in corners.items() if at[axis]}
            corners = {at: near[at] + share[:, axis] * (far[at] - near[at]) for at in near}
        values[:, ray] = corners[()]
    return values


@pytest.mark.parametrize("shape", [(5, 7, 9), (1, 4, 1), (3, 1, 2), (1, 1, 1)])
@pytest.mark.parametrize(("rays", "samples"), [(1, 1), (19, 130), (8, 64)])
def test_samples_are_those_of_numpy_for_any_threads(shape, rays, samples):
    random = np.random.default_rng(5)
    patches = random.normal(size=(3, *shape))
    # Far before the patch and beyond it, towards both sides.
    starts, velocities = random.uniform(-40, 40, (rays, 3)), random.normal(size=(rays, 3))
    velocities[0] = (0, 1, 0)
    expected = slow(patches, starts, velocities, 0.37, samples)
    for threads in (1, 3):
        values = np.full((samples, rays), np.nan)
        _native.sample_patches(patches, starts, velocities, 0.37, values, threads)
        np.testing.assert_array_equal(values, expected)


def test_a_ray_comes_back_the_way_it_went():
    patch = np.arange(4.0).reshape(1, 1, 1, 4)
    values = np.empty((16, 1))
    _native.sample_patches(patch, np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), 0.5, values)
    np.testing.assert_allclose(values[:8, 0], [0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3])
    np.testing.assert_array_equal(values[8:], values[7::-1])


@pytest.mark.parametrize(
    ("patches", "starts", "velocities", "values"),
    [
        ((0, 2, 2, 2), 3, 3, (4, 3)),
        ((1, 2, 0, 2), 3, 3, (4, 3)),
        ((1, 2, 2, 2), 3, 2, (4, 3)),
        ((1, 2, 2, 2), 3, 3, (4, 2)),
    ],
    ids=["no patch", "no voxel", "velocities", "values"],
)
def test_what_does_not_fit_is_refused(patches, starts, velocities, values):
    with pytest.raises(ValueError, match=r"must|expected"):
        _native.sample_patches(
            np.zeros(patches), np.zeros((starts, 3)), np.zeros((velocities, 3)), 1.0, np.zeros(values)
        )
