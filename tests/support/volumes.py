"""Volumes for kernel tests: odd shapes, every voxel type, and the values that break careless code."""

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

VOXEL_TYPES = [np.dtype(np.uint8), np.dtype(np.int16), np.dtype(np.uint16), np.dtype(np.float32)]
THREADS = (1, 2, 3)

lengths = st.integers(1, 20)
shapes = st.tuples(lengths, lengths, lengths)
voxel_types = st.sampled_from(VOXEL_TYPES)

_TINY = np.finfo(np.float32).smallest_subnormal
_HUGE = np.finfo(np.float32).max
SPECIAL_FLOATS = np.array(
    [0, -0.0, 1, -1, 0.5, _TINY, -_TINY, 3 * _TINY, _HUGE, -_HUGE, np.inf, -np.inf, np.nan, -np.nan], np.float32
)


@st.composite
def volumes(draw, types=voxel_types, shapes=shapes):
    """Draw a volume: anything its type can hold, few different values, or float32 with everything that is special."""
    dtype = draw(types)
    shape = draw(shapes)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = draw(st.sampled_from(["any", "few", "special"]))
    if kind == "few":
        return rng.integers(0, 4, shape).astype(dtype)
    if dtype.kind == "f":
        finite = (rng.normal(size=shape) * 10.0 ** rng.integers(-3, 4, shape)).astype(dtype)
        return rng.choice(SPECIAL_FLOATS, shape) if kind == "special" else finite
    info = np.iinfo(dtype)
    if kind == "special":
        return rng.choice(np.array([info.min, info.min + 1, 0, info.max - 1, info.max], dtype), shape)
    return rng.integers(info.min, info.max, shape, dtype, endpoint=True)


def same_bytes(actual: NDArray[np.generic], expected: NDArray[np.generic]) -> bool:
    """Tell whether two arrays are equal bit by bit: NaN equals itself, and -0 is not +0."""
    return actual.dtype == expected.dtype and actual.shape == expected.shape and actual.tobytes() == expected.tobytes()
