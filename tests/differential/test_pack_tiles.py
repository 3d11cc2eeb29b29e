"""pack_tiles against a twin that copies texel by texel."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volumes import THREADS

from volprep.kernels import _native

sizes = st.integers(1, 9)


@st.composite
def strips(draw):
    """Planes [slice, row, byte], the step, the gutter, bytes of a voxel and columns of the strip."""
    channels = draw(st.sampled_from([1, 4]))
    texel = draw(st.sampled_from([1, 2] if channels == 4 else [1, 2, 3, 4, 8]))
    height, width, gutter, step, tiles = draw(sizes), draw(sizes), draw(st.integers(0, 3)), draw(sizes), draw(sizes)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    planes = [
        rng.integers(0, 256, (draw(st.integers(0, 12)), height, width * texel), dtype=np.uint8) for _ in range(channels)
    ]
    columns = tiles * (width + 2 * gutter) + draw(st.integers(0, 5))
    return planes, step, gutter, texel, columns


def twin(planes, step, gutter, texel, columns):
    height, width = planes[0].shape[1], planes[0].shape[2] // texel
    pitch = width + 2 * gutter
    strip = np.zeros((height + 2 * gutter, columns, len(planes), texel), np.uint8)
    for tile in range(columns // pitch):
        for channel, plane in enumerate(planes):
            if tile * step < len(plane):
                slice_ = plane[tile * step].reshape(height, width, texel)
                edged = np.pad(slice_, ((gutter, gutter), (gutter, gutter), (0, 0)), mode="edge")
                strip[:, tile * pitch : (tile + 1) * pitch, channel] = edged
    return strip.reshape(height + 2 * gutter, columns, -1)


@given(strips())
def test_tiles_are_those_of_the_twin_on_any_number_of_threads(case):
    planes, step, gutter, *_ = case
    expected = twin(*case)
    for threads in THREADS:
        strip = np.full(expected.shape, 255, np.uint8)
        _native.pack_tiles(planes, step, gutter, strip, threads)
        np.testing.assert_array_equal(strip, expected)


PLANE = np.zeros((2, 3, 4), np.uint8)


@pytest.mark.parametrize(
    ("planes", "step", "gutter", "shape", "says"),
    [
        ([PLANE] * 2, 1, 0, (3, 4, 1), "planes has 2 entries, expected 1 or 4"),
        ([PLANE], 0, 0, (3, 4, 1), "step is 0"),
        ([PLANE], 1, -1, (3, 4, 1), "gutter is -1"),
        ([PLANE] * 4, 1, 0, (3, 4, 3), "dst has texels of 3 bytes, expected 4 or 8"),
        ([PLANE] * 4, 1, 0, (3, 4, 12), "dst has texels of 12 bytes"),
        ([PLANE], 1, 0, (3, 4, 3), "planes\\[0\\] has shape \\(2, 3, 4\\), expected whole texels of 3 bytes"),
        (
            [PLANE, PLANE, PLANE, PLANE[:, :2]],
            1,
            0,
            (3, 4, 4),
            "planes has shape \\(2, 2, 4\\), expected \\(2, 3, 4\\)",
        ),
        ([PLANE], 1, 0, (4, 4, 1), "dst has 4 rows of 4 texels, expected 3 of at least 4"),
        ([PLANE], 1, 1, (5, 5, 1), "dst has 5 rows of 5 texels, expected 5 of at least 6"),
    ],
)
def test_sizes_that_do_not_fit_are_refused(planes, step, gutter, shape, says):
    with pytest.raises(ValueError, match=says):
        _native.pack_tiles([np.ascontiguousarray(plane) for plane in planes], step, gutter, np.zeros(shape, np.uint8))


def test_other_types_are_refused():
    with pytest.raises(TypeError, match="planes is uint16, expected uint8"):
        _native.pack_tiles([PLANE.astype(np.uint16)], 1, 0, np.zeros((3, 4, 1), np.uint8))
    with pytest.raises(TypeError, match="dst is int8, expected uint8"):
        _native.pack_tiles([PLANE], 1, 0, np.zeros((3, 4, 1), np.int8))
