"""Scans one voxel wide: rays may all be shorter than a step, and may all miss the volume."""

from pathlib import Path

import nibabel
import numpy as np
import pytest

from volprep.pipeline.build import build
from volprep.scene.request import request_for_source
from volprep.validation.folder import report_folder
from volprep.validation.run import measure_package
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent


def test_the_table_of_a_single_voxel_holds_the_whole_extinction(tmp_path: Path) -> None:
    nibabel.save(nibabel.Nifti1Image(np.full((1, 1, 1), 100, np.int16), np.eye(4)), tmp_path / "voxel.nii")
    manifest = build(request_for_source(tmp_path / "voxel.nii"), tmp_path / "voxel.volpkg", Silent())
    (table,) = [texture for texture in manifest.textures if texture.role == "transfer"]
    content = Package.open(tmp_path / "voxel.volpkg").read_bytes(table.file)
    entries = np.frombuffer(content[-8 * table.shape_zyx[2] :], np.float16).reshape(-1, 4)
    (point, _) = manifest.channels[0].transfer_functions[0].points
    assert entries[:, 3] == pytest.approx(point.extinction_per_mm, rel=1e-3)


def test_a_row_of_voxels_that_no_ray_of_a_small_picture_meets_is_measured(tmp_path: Path) -> None:
    row = np.full((1, 1, 60), 100, np.int16)
    nibabel.save(nibabel.Nifti1Image(row, np.eye(4)), tmp_path / "row.nii")
    build(request_for_source(tmp_path / "row.nii"), tmp_path / "row.volpkg", Silent())
    (tmp_path / "scratch").mkdir()
    with report_folder(tmp_path / "report") as folder:
        report = measure_package(tmp_path / "row.volpkg", folder, tmp_path / "scratch", Silent(), picture_size=16)
    assert {point.samples_mean for point in report.programs[0].sweep.points} == {0.0}
