"""The oracle on a real head: sharp where nothing is known in advance but its outline."""

import nibabel
import numpy as np
from tiny_packages import function

from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid

SKIN = function(*((value, (0.8, 0.5, 0.4), extinction) for value, extinction in [(35, 0.0), (36, 0.25), (255, 0.6)]))


def test_the_silhouette_of_a_head_is_where_voxels_are_above_the_threshold(scans):
    stored = np.asarray(nibabel.load(scans / "nifti_ch2" / "ch2.nii.gz").dataobj)
    volume = np.ascontiguousarray(stored.transpose(2, 1, 0))
    grid = Grid.of(volume.shape, (1.0, 1.0, 1.0))
    height, width = volume.shape[0], volume.shape[2]
    # Looking along y, one pixel a column of voxels, z up: rays go through voxel centres.
    camera = np.array(
        [[width / 2, 0, 0, width / 2], [0, 0, 200.0, 100.0], [0, height / 2, 0, height / 2], [0, 0, 0, 1]]
    )
    answer = oracle_picture(Volume(volume, grid), SKIN, camera, (height, width))
    seen = answer.rgba[::-1, :, 3] > 0
    np.testing.assert_array_equal(seen, volume.max(axis=1) > 35)
    assert 0.3 < seen.mean() < 0.9
    assert answer.bound.max() <= 1e-6
