"""Voxels of some nanometres, as of electron microscopy: half floats cannot hold their extinction per millimetre."""

from pathlib import Path

import nibabel
import numpy as np
import pytest
from PIL import Image

from volprep.pipeline.build import build
from volprep.scene.request import request_for_source
from volprep_formats.progress import Silent


def preview_of(folder: Path, spacing_mm: float) -> tuple[np.ndarray, str]:
    """Build a ball with voxels of this size; return its picture and the format of its lookup table."""
    folder.mkdir()
    z, y, x = np.ogrid[-8:8, -9:9, -10:10]
    ball = (1000 * np.exp(-(x**2 + y**2 + z**2) / 40.0)).astype(np.int16)
    nibabel.save(nibabel.Nifti1Image(ball.T, np.diag([spacing_mm] * 3 + [1.0])), folder / "ball.nii")
    manifest = build(request_for_source(folder / "ball.nii"), folder / "ball.volpkg", Silent())
    table = next(texture for texture in manifest.textures if texture.role == "transfer")
    with Image.open(folder / "ball.volpkg" / "preview.png") as picture:
        return np.asarray(picture.convert("RGBA"), np.float64), table.format


@pytest.mark.parametrize("spacing_mm", [4e-6, 1e-7])
def test_a_scan_of_nanometres_looks_like_one_of_millimetres(tmp_path: Path, spacing_mm: float) -> None:
    large, of_large = preview_of(tmp_path / "large", 1.0)
    small, of_small = preview_of(tmp_path / "small", spacing_mm)
    assert (of_large, of_small) == ("rgba16float", "rgba8unorm")
    assert large.max() > 100.0
    assert np.abs(large - small).mean() < 1.0
