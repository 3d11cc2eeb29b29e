"""Numbers that 32-bit floating point rounds: of labels, as in the Allen mouse atlas, none are merged."""

from collections.abc import Callable
from pathlib import Path

import nibabel
import numpy as np
import pytest
import tifffile
import zarr

from volprep.scan.channels import opened_channel
from volprep.scan.label_map import recognise_labels
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

NUMBERS = (0, 312782546, 312782550, 312782554, 614454277)
CODES = np.repeat(np.arange(5), 12).reshape(5, 3, 4)
VOXELS = np.array(NUMBERS)[CODES]


def as_nifti(file: Path) -> Path:
    nibabel.save(nibabel.Nifti1Image(VOXELS.T.astype(np.int32), np.eye(4)), file.with_suffix(".nii"))
    return file.with_suffix(".nii")


def as_array(file: Path) -> Path:
    np.save(file.with_suffix(".npy"), VOXELS.astype(np.uint64))
    return file.with_suffix(".npy")


def as_doubles(file: Path) -> Path:
    np.save(file.with_suffix(".npy"), VOXELS.astype(np.float64))
    return file.with_suffix(".npy")


def as_ome_tiff(file: Path) -> Path:
    voxels = VOXELS.astype(np.uint32)
    tifffile.imwrite(file.with_suffix(".ome.tif"), voxels, photometric="minisblack", metadata={"axes": "ZYX"})
    return file.with_suffix(".ome.tif")


def as_ome_zarr(file: Path) -> Path:
    group = zarr.open_group(str(file.with_suffix(".zarr")), mode="w", zarr_format=2)
    group.create_array("0", data=VOXELS)
    scale = {"type": "scale", "scale": [1.0, 1.0, 1.0]}
    axes = [{"name": name, "type": "space", "unit": "millimeter"} for name in "zyx"]
    levels = [{"path": "0", "coordinateTransformations": [scale]}]
    group.attrs["multiscales"] = [{"version": "0.4", "axes": axes, "datasets": levels}]
    return file.with_suffix(".zarr")


def mask_of_all(folder: Path) -> str:
    np.save(folder / "mask.npy", np.ones(VOXELS.shape, np.uint8))
    return str(folder / "mask.npy")


@pytest.mark.parametrize("write", [as_nifti, as_array, as_doubles, as_ome_tiff, as_ome_zarr])
def test_labels_of_large_numbers_keep_their_numbers(tmp_path: Path, write: Callable[[Path], Path]) -> None:
    spec = SourceSpec(path=str(write(tmp_path / "a")), labels=True)
    with opened_channel(spec, Silent()) as source:
        assert source.info.label_numbers == NUMBERS
        assert np.array_equal(source.read_slab(0, 5), CODES)
        assert not any("rounded" in remark for remark in source.info.remarks)


def test_a_mask_keeps_large_numbers(tmp_path: Path) -> None:
    spec = SourceSpec(path=str(as_array(tmp_path / "a")), labels=True, mask=mask_of_all(tmp_path), outside=0.0)
    with opened_channel(spec, Silent()) as source:
        assert source.info.label_numbers == NUMBERS


def test_labels_of_large_numbers_are_recognised_by_all_of_them(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", VOXELS.repeat(4, 0).repeat(4, 1).repeat(4, 2))
    with open_source(SourceSpec(path=str(tmp_path / "a.npy")), Path(), Silent()) as source:
        found = recognise_labels(source, tmp_path / "a.npy")
    assert found is not None
    assert "4 whole numbers" in found.reason


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (np.arange(10**8, 10**8 + 64, dtype=np.int32), "from 100000000 to 100000063, in steps of 8; subtract"),
        (np.arange(10**8, 10**8 + 64, dtype=np.int64) * 1000, "from 100000000000 to 100000063000, in steps of 8192"),
        (
            np.arange(2**63, 2**63 + 64, dtype=np.uint64),
            "from 9223372036854775808 to 9223372036854775871, in steps of 1.09951e+12",
        ),
        (np.arange(64.0) + 1e9, "1000000032 to 1000000047 in the middle slice, in steps of 64; subtract"),
        (np.arange(64.0) * 1e-300, "which they do not hold; multiply"),
        (np.arange(64.0) * 1e300, "which they do not hold; multiply"),
        (np.arange(64.0), ""),
        (np.arange(64.0) * np.nan, ""),
        (np.full(64, 1e9), ""),
        (np.array([0, 2**30]).repeat(32), "from 0 to 1073741824"),
    ],
)
def test_what_rounding_to_floats_loses_is_remarked_with_numbers(tmp_path: Path, values: np.ndarray, said: str) -> None:
    np.save(tmp_path / "a.npy", values.reshape(4, 4, 4))
    with open_source(SourceSpec(path=str(tmp_path / "a.npy")), Path(), Silent()) as source:
        remarks = " ".join(source.info.remarks)
    assert said in remarks
    assert "in steps of" in said or "steps" not in remarks


def test_a_label_whose_number_is_not_exact_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array(2**60 + 1).repeat(8).reshape(2, 2, 2))
    with (
        pytest.raises(VolprepError, match="VP1307"),
        opened_channel(SourceSpec(path=str(tmp_path / "a.npy"), labels=True), Silent()),
    ):
        pass


def test_a_mask_that_is_nan_somewhere_is_refused_with_the_slice(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", np.ones((5, 4, 3), np.float32))
    mask = np.ones((5, 4, 3), np.float32)
    mask[3, 1, 1] = np.nan
    np.save(tmp_path / "mask.npy", mask)
    spec = SourceSpec(path=str(tmp_path / "scan.npy"), mask=str(tmp_path / "mask.npy"), outside=0.0)
    with opened_channel(spec, Silent()) as source, pytest.raises(VolprepError) as error:
        source.read_slab(0, 5)
    assert (error.value.code, "slice 3" in error.value.summary) == ("VP2082", True)
