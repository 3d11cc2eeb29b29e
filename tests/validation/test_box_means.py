"""Means of a scan over cells, which validation compares filters with, are made slab by slab."""

import numpy as np
import pytest

from volprep.kernels import _native
from volprep.truth.decoded import Volume
from volprep.validation import levels
from volprep.validation.levels import box_means
from volprep_formats.grid import Grid

SHAPE = (23, 9, 11)


@pytest.mark.parametrize("slab_voxels", [1, 300, 2**22])
@pytest.mark.parametrize("factors", [(2, 2, 2), (4, 1, 3), (8, 8, 8), (1, 1, 1)])
def test_slabs_make_the_same_means_as_the_whole(factors, slab_voxels, monkeypatch) -> None:
    monkeypatch.setattr(levels, "_SLAB_VOXELS", slab_voxels)
    stored = np.random.default_rng(2).integers(-500, 3000, SHAPE).astype(np.int16)
    scan = Volume(stored, Grid.of(SHAPE, (1.0, 1.0, 1.0)), 0.7, -3.0)
    part = (slice(1, 22), slice(0, 9), slice(2, 11))
    whole = stored[part].astype(np.float32) * np.float32(0.7) + np.float32(-3.0)
    expected = np.empty(_native.box_reduced_shape(whole.shape, factors), np.float32)
    _native.box_reduce(whole, expected, factors)
    np.testing.assert_array_equal(box_means(scan, part, factors), expected)


def test_memory_does_not_grow_with_the_depth_of_the_scan(monkeypatch) -> None:
    sizes = []
    reduce = _native.box_reduce
    monkeypatch.setattr(levels, "_SLAB_VOXELS", 4 * 9 * 11)
    monkeypatch.setattr(_native, "box_reduce", lambda slab, *others: (sizes.append(slab.size), reduce(slab, *others)))
    scan = Volume(np.zeros(SHAPE, np.uint16), Grid.of(SHAPE, (1.0, 1.0, 1.0)), 1.0, 0.0)
    box_means(scan, (slice(None),) * 3, (2, 2, 2))
    assert len(sizes) == 6
    assert max(sizes) == 4 * 9 * 11
