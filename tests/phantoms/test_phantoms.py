"""Phantoms hold what they are named for; `make phantoms` builds them."""

from pathlib import Path

import nibabel
import numpy as np
import pytest

from .scenes import PHANTOMS, segments_lit


@pytest.mark.parametrize("name", PHANTOMS)
def test_a_phantom_names_a_file_that_it_wrote(name: str, tmp_path: Path) -> None:
    assert PHANTOMS[name](tmp_path).stat().st_size > 0


def test_five_segments_have_few_voxels(tmp_path: Path) -> None:
    segments_lit(tmp_path)

    voxels = np.bincount(np.asarray(nibabel.load(tmp_path / "labels.nii").dataobj, np.uint8).ravel())[3:]

    assert voxels.tolist() == [1, 2, 1, 16, 8]
