"""The box reference: means of a scan over cells, in NumPy alone."""

import numpy as np
import pytest

from volprep.kernels import _native
from volprep.truth import box
from volprep.truth.box import box_levels, frequent_level

SHAPE = (23, 9, 11)
STORED = np.random.default_rng(2).integers(-500, 3000, SHAPE).astype(np.int16)


@pytest.mark.parametrize("slab_voxels", [1, 300, 2**22])
@pytest.mark.parametrize(
    "levels",
    [[(2, 2, 2), (4, 4, 4), (8, 8, 8)], [(1, 2, 2), (2, 4, 4), (6, 4, 8)], [(2, 1, 3)], [(2, 2, 2), (3, 3, 3)]],
)
def test_each_level_has_the_means_of_its_cells_whatever_the_slabs(levels, slab_voxels, monkeypatch) -> None:
    monkeypatch.setattr(box, "_SLAB_VOXELS", slab_voxels)
    for factors, means in zip(levels, box_levels(STORED, levels), strict=True):
        expected = np.empty(_native.box_reduced_shape(SHAPE, factors), np.float32)
        _native.box_reduce(STORED.astype(np.float32), expected, factors)
        np.testing.assert_allclose(means, expected, rtol=1e-5, atol=1e-2)


def test_the_voxels_are_read_once_for_all_levels(monkeypatch) -> None:
    class Counted(np.ndarray):
        read = 0

        def __getitem__(self, key):
            if isinstance(key, slice):
                Counted.read += len(range(*key.indices(len(self))))
            return super().__getitem__(key)

    monkeypatch.setattr(box, "_SLAB_VOXELS", 4 * 9 * 11)
    assert len([*box_levels(STORED.view(Counted), [(2, 2, 2), (4, 4, 4)])]) == 2
    assert Counted.read == 23


def test_a_level_of_labels_has_the_most_frequent_label_of_each_cell() -> None:
    labels = np.array([[[7, 7, 300, 300, 5], [7, 9, 300, 2, 6]]], np.uint16)
    np.testing.assert_array_equal(frequent_level(labels, (2, 2, 2)), [[[7, 300, 5]]])
