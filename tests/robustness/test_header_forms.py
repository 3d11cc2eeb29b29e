"""Damaged files of NRRD, MetaImage and VTK in the forms that `SUBJECTS` leaves out, with fewer cases each."""

import numpy as np
import pytest

from .header_subjects import metaimage_file, nrrd_file, vtk_file
from .mutations import assert_survives
from .subjects import read_volume

VALUES = np.random.default_rng(4).integers(0, 2000, (3, 5, 4)).astype(np.int16)
FORMS = {
    "bzip2": (".nrrd", nrrd_file(VALUES, "bzip2")),
    "gzip": (".nrrd", nrrd_file(VALUES, "gzip")),
    "ascii": (".nrrd", nrrd_file(VALUES, "ascii")),
    "zlib": (".mha", metaimage_file(VALUES, packed=True)),
    "legacy text": (".vtk", vtk_file(VALUES, ".vtk", "text")),
    "text": (".vti", vtk_file(VALUES, ".vti", "text")),
    "inline": (".vti", vtk_file(VALUES, ".vti", "inline")),
    "appended zlib": (".vti", vtk_file(VALUES, ".vti", "appended zlib")),
    "appended": (".vti", vtk_file(VALUES, ".vti", "appended")),
    "base64": (".vti", vtk_file(VALUES, ".vti", "base64")),
}


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("form", FORMS)
def test_three_hundred_damaged_files_are_read_or_refused_with_a_code(form, tmp_path) -> None:
    suffix, make = FORMS[form]
    outcomes = assert_survives(make(tmp_path), suffix, read_volume, tmp_path, count=300, seed=5)
    assert 10 < outcomes["read"] < 290
