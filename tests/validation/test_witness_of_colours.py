"""Voxels that are no numbers are named by the second reading, whatever the library returns for them."""

from pathlib import Path

import nibabel
import numpy as np
import pytest

from volprep.validation.witness.independent.scan import CannotWitnessError
from volprep.validation.witness.independent.sources import read_scan


@pytest.mark.parametrize("components", ["RGB", "RGBA"])
def test_a_nifti_in_colour_is_named(components: str, tmp_path: Path) -> None:
    texels = np.zeros((4, 3, 2), [(name, np.uint8) for name in components])
    nibabel.save(nibabel.Nifti1Image(texels, np.eye(4)), tmp_path / "c.nii")

    with pytest.raises(CannotWitnessError, match="its voxels are colours"):
        read_scan({"path": tmp_path / "c.nii"})


def test_an_array_in_colour_is_named(tmp_path: Path) -> None:
    np.save(tmp_path / "c.npy", np.zeros((2, 3, 4, 3), np.uint8))

    with pytest.raises(CannotWitnessError, match="its voxels are colours"):
        read_scan({"path": tmp_path / "c.npy", "array": {"spacing_mm_zyx": (1.0, 1.0, 1.0)}})
