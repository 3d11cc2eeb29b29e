"""The DICOM writer: what is read back is what was written."""

import subprocess
from pathlib import Path
from shutil import which

import numpy as np
import pydicom
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec
from volprep_formats.writers import dicom

OBLIQUE = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


class Volume:
    """A source in memory."""

    def __init__(self, voxels: np.ndarray, grid: Grid | None = None, **info) -> None:
        grid = grid or Grid.of(voxels.shape, (2.5, 1.5, 0.7), (-91.4495864331908, 12.5, 1e-7 / 3), OBLIQUE)
        self.voxels = voxels
        self.info = SourceInfo(format="raw", grid=grid, stored_type=voxels.dtype.name, **info)

    def read_slab(self, z0: int, z1: int) -> np.ndarray:
        return self.voxels[z0:z1]


def noise(dtype: str, shape=(19, 5, 7)) -> np.ndarray:
    limits = np.iinfo(dtype)
    return np.random.default_rng(3).integers(limits.min, limits.max, shape, dtype=dtype, endpoint=True)


def write_and_read(volume: Volume, folder: Path) -> tuple[np.ndarray, SourceInfo]:
    dicom.write(volume, folder, Silent())
    with open_source(SourceSpec(path=str(folder)), Path(), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


@pytest.mark.parametrize("modality", ["MR", "CT", "PT", ""])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16"])
def test_integer_volumes_read_back_exactly(tmp_path, dtype, modality) -> None:
    volume = Volume(
        noise(dtype), modality=modality, slope=0.5, intercept=-1024.0, unit="HU" if modality == "CT" else ""
    )
    voxels, info = write_and_read(volume, tmp_path / "series")
    assert np.array_equal(voxels, volume.voxels)
    assert info.modality == (modality or "OT")
    assert (info.stored_type, info.slope, info.intercept, info.unit) == (dtype, 0.5, -1024.0, volume.info.unit)
    assert info.remarks == ()


@pytest.mark.long
@given(st.lists(st.floats(-1, 1), min_size=9, max_size=9), st.lists(st.floats(-5000, 5000), min_size=3, max_size=3))
def test_positions_hold_to_a_millionth_of_a_millimetre(tmp_path_factory, turn, origin) -> None:
    direction = np.linalg.qr(np.array(turn).reshape(3, 3) + 2 * np.eye(3))[0]
    direction *= np.sign(np.linalg.det(direction))
    grid = Grid.of((3, 2, 4), (1 / 3, 2 / 7, 10 / 9), origin, direction)
    _, info = write_and_read(Volume(noise("uint8", (3, 2, 4)), grid), tmp_path_factory.mktemp("dicom") / "series")
    # The far corner of a volume of 1000 voxels along each axis.
    corners = np.array([[0, 0, 0, 1], [999, 999, 999, 1]]).T
    assert np.abs(grid.world_from_index @ corners - info.grid.world_from_index @ corners).max() < 1e-6


def test_a_left_handed_volume_reads_back_in_reverse_at_the_same_places(tmp_path) -> None:
    grid = Grid.of((4, 2, 3), (2.0, 1.0, 1.0), (5, 6, 7), np.diag([1.0, 1.0, -1.0]))
    volume = Volume(noise("int16", (4, 2, 3)), grid)
    voxels, info = write_and_read(volume, tmp_path / "series")
    assert np.array_equal(voxels[::-1], volume.voxels)
    np.testing.assert_allclose(info.grid.world_from_index @ [0, 0, 3, 1], [5, 6, 7, 1])


def test_whole_floats_are_stored_exactly(tmp_path) -> None:
    volume = Volume(np.array([[[-3.0, 500.0]], [[0.0, 7.0]]], np.float32), slope=2.0)
    voxels, info = write_and_read(volume, tmp_path / "series")
    assert info.stored_type == "int16"
    assert np.array_equal(voxels, volume.voxels)
    assert info.slope == 2.0


def test_other_floats_are_off_by_half_a_step_at_most(tmp_path) -> None:
    values = np.random.default_rng(1).normal(0.0, 40.0, (5, 6, 7)).astype(np.float32)
    volume = Volume(values, slope=-0.25, intercept=3.0)
    voxels, info = write_and_read(volume, tmp_path / "series")
    physical = values.astype(np.float64) * -0.25 + 3.0
    # The slope has 16 characters: 65535 of them sum up to less than a hundredth of a step of error.
    assert np.abs(voxels * info.slope + info.intercept - physical).max() <= 0.51 * info.slope
    assert voxels.min() == 0
    assert voxels.max() == 65535


def test_a_constant_float_volume_is_stored(tmp_path) -> None:
    voxels, info = write_and_read(Volume(np.full((2, 2, 2), 0.3, np.float32)), tmp_path / "series")
    assert voxels[0, 0, 0] * info.slope + info.intercept == pytest.approx(0.3, abs=1e-7)


def test_a_volume_that_is_not_finite_is_refused_and_leaves_nothing(tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP1082"):
        dicom.write(Volume(np.array([[[1.0, np.nan]]], np.float32)), tmp_path / "series", Silent())
    assert list(tmp_path.iterdir()) == []


def test_the_same_volume_gives_the_same_bytes_and_another_gives_other_uids(tmp_path) -> None:
    first = dicom.write(Volume(noise("uint8")), tmp_path / "a", Silent(), description="brain")
    again = dicom.write(Volume(noise("uint8")), tmp_path / "b", Silent(), description="brain")
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in again]
    other = dicom.write(Volume(noise("uint8") ^ 1), tmp_path / "c", Silent(), description="brain")
    assert pydicom.dcmread(first[0]).SeriesInstanceUID != pydicom.dcmread(other[0]).SeriesInstanceUID


def test_files_carry_valid_values_and_no_identity(tmp_path, monkeypatch) -> None:
    files = dicom.write(Volume(noise("int16"), modality="MR"), tmp_path / "s", Silent(), description="a\\b" * 40)
    monkeypatch.setattr(pydicom.config.settings, "reading_validation_mode", pydicom.config.RAISE)
    data = pydicom.dcmread(files[4])
    str(data)  # converts every value, which raises on one that the standard does not allow
    assert data.InstanceNumber == 5
    assert len(data.SeriesDescription) == 64
    assert not any(data.get(keyword) for keyword in ("PatientName", "PatientID", "PatientBirthDate", "StudyDate"))
    assert len({pydicom.dcmread(file).SOPInstanceUID for file in files}) == len(files)


def test_a_folder_that_holds_something_is_left_alone(tmp_path) -> None:
    (tmp_path / "series").mkdir()
    (tmp_path / "series" / "mine").write_text("x")
    with pytest.raises(VolprepError, match="VP1080"):
        dicom.write(Volume(noise("uint8")), tmp_path / "series", Silent())
    assert [p.name for p in (tmp_path / "series").iterdir()] == ["mine"]


def test_a_failure_in_the_middle_leaves_nothing(tmp_path, monkeypatch) -> None:
    def fail_at_third(path: Path, *rest: object, **options: object) -> None:
        if path.name == "slice_00003.dcm":
            msg = "With tag (7FE0,0010) got exception: No space left on device\nTraceback (most recent call last):"
            raise OSError(msg)
        path.touch()

    monkeypatch.setattr(dicom, "dcmwrite", fail_at_third)
    with pytest.raises(VolprepError) as error:
        dicom.write(Volume(noise("uint8")), tmp_path / "series", Silent())
    assert error.value.code == "VP1081"
    assert "No space left" in str(error.value)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(which("dcm2niix") is None, reason="dcm2niix is not installed")
def test_dcm2niix_reads_the_same_voxels_at_the_same_places(tmp_path) -> None:
    import nibabel

    volume = Volume(noise("int16"), modality="MR")
    dicom.write(volume, tmp_path / "series", Silent())
    subprocess.run(["dcm2niix", "-z", "n", "-b", "n", "-f", "out", "-o", tmp_path, tmp_path / "series"], check=True)
    theirs = nibabel.load(tmp_path / "out.nii")
    data = np.asarray(theirs.dataobj)
    world = np.diag([-1.0, -1.0, 1.0, 1.0]) @ theirs.affine
    index = np.linalg.inv(world) @ volume.info.grid.world_from_index
    for z, y, x in [(0, 0, 0), (18, 4, 6), (3, 1, 5)]:
        i, j, k, _ = index @ [x, y, z, 1]
        # NIfTI's affine is in 32-bit floating point.
        np.testing.assert_allclose([i, j, k], np.round([i, j, k]), atol=1e-4)
        assert data[round(i), round(j), round(k)] == volume.voxels[z, y, x]
