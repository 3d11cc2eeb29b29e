"""value_range against NumPy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volumes import THREADS, volumes

from volprep.kernels import _native

float_volumes = volumes(types=st.just(np.dtype(np.float32)))


@given(float_volumes)
def test_the_range_is_that_of_the_finite_voxels_and_the_others_are_counted(src):
    finite = src[np.isfinite(src)]
    for threads in THREADS:
        found = _native.value_range(src, threads)
        assert found.minimum == finite.min(initial=np.inf)
        assert found.maximum == finite.max(initial=-np.inf)
        assert found.nan == np.isnan(src).sum()
        assert found.negative_infinite == np.isneginf(src).sum()
        assert found.positive_infinite == np.isposinf(src).sum()


@pytest.mark.parametrize("zeros", [[-0.0], [0.0, -0.0], [-0.0, 0.0]])
def test_the_zero_of_a_range_is_positive(zeros):
    found = _native.value_range(np.array([[zeros]], np.float32))
    assert math.copysign(1, found.minimum) == math.copysign(1, found.maximum) == 1


def test_a_volume_without_voxels_is_a_value_error():
    with pytest.raises(ValueError, match="at least one voxel"):
        _native.value_range(np.zeros((0, 1, 1), np.float32))
