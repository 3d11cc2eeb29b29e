"""What a manifest says about slices agrees with its profile, levels and transfer functions."""

from shutil import copytree

import numpy as np
import pytest
from slice_packages import missing_es11, slice_package

from volprep_formats.package.check import check
from volprep_formats.package.rules import contradictions

pytestmark = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    codes = np.random.default_rng(1).integers(0, 256, (7, 15, 31))
    return slice_package(tmp_path_factory.mktemp("slices"), codes, (2.0, 1.0, 1.0))


Z = "slices-ramp-z-0"
X = "slices-ramp-x-1"


def test_a_package_that_was_built_is_sound(package):
    assert check(package.path) == []
    assert list(contradictions(package.manifest)) == []
    assert X in {texture.name for texture in package.manifest.textures}


def test_a_paletted_file_that_was_cut_is_found(package, tmp_path):
    copy = tmp_path / "cut.volpkg"
    copytree(package.path, copy)
    file = copy / "slices" / f"{Z}.pal8"
    file.write_bytes(file.read_bytes()[:-1])
    assert check(copy)
