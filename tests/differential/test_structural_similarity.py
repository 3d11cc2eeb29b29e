"""The native structural similarity against scikit-image's."""

import numpy as np
import pytest
from skimage.metrics import structural_similarity

from volprep.kernels import _native


def fast(one, other, counted, threads=1):
    sums = np.full(len(one), np.nan)
    _native.structural_similarity(one, other, counted, sums, threads)
    return sums


def slow(one, other, counted):
    _, similar = structural_similarity(
        one,
        other,
        channel_axis=2,
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    return (similar * counted[..., None]).sum(axis=(1, 2))


@pytest.mark.parametrize("shape", [(11, 11), (11, 40), (57, 12), (33, 35)])
@pytest.mark.parametrize("share", [1.0, 0.5, 0.01, 0.0])
def test_sums_are_those_of_scikit_image(shape, share):
    random = np.random.default_rng(2)
    one = random.random((*shape, 3))
    other = np.clip(one + random.normal(0, 0.1, one.shape), 0, 1)
    counted = random.random(shape) < share
    np.testing.assert_allclose(fast(one, other, counted), slow(one, other, counted), rtol=1e-12, atol=1e-13)


def test_what_is_equal_is_wholly_similar():
    one = np.random.default_rng(4).random((20, 30, 3))
    np.testing.assert_allclose(fast(one, one, np.ones((20, 30), bool)), 90.0, rtol=1e-12)


def test_sums_do_not_depend_on_the_threads():
    one, other = np.random.default_rng(5).random((2, 50, 40, 3))
    counted = one[..., 0] > 0.3
    np.testing.assert_array_equal(fast(one, other, counted, 1), fast(one, other, counted, 3))


@pytest.mark.parametrize(
    ("one", "other", "counted", "sums"),
    [
        ((11, 10, 3), (11, 10, 3), (11, 10), 11),
        ((12, 12, 3), (12, 13, 3), (12, 12), 12),
        ((12, 12, 3), (12, 12, 3), (12, 11), 12),
        ((12, 12, 3), (12, 12, 3), (12, 12), 11),
    ],
    ids=["small", "other", "counted", "sums"],
)
def test_what_does_not_fit_is_refused(one, other, counted, sums):
    with pytest.raises(ValueError, match="must"):
        _native.structural_similarity(np.zeros(one), np.zeros(other), np.zeros(counted, bool), np.zeros(sums))
