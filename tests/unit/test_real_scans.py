"""Real scans: geometry and voxels against independent readers and recorded facts."""

import gzip
import hashlib
import subprocess
from pathlib import Path
from shutil import which

import nibabel
import numpy as np
import pytest
from dicom_files import read_slices

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import RawLayout, SourceInfo, SourceSpec

pytestmark = pytest.mark.usefixtures("kept_workers")

LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
COMPRESSED = ("j2k", "jpeg", "jpegls", "rle")

# dcm2niix v1.0.20220720 on mr_t1_studyforrest: its affine (32-bit floats, RAS, rows from bottom to top).
STUDYFORREST_AFFINE_RAS = np.array(
    [
        [-6.993103623e-01, 1.767965220e-02, 2.339460701e-02, 8.467827606e01],
        [1.525159646e-02, 6.609426141e-01, -8.595605940e-02, -9.308065796e01],
        [2.674628608e-02, 8.536264300e-02, 6.606919765e-01, -1.751993866e02],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


def read(path: Path, **spec) -> tuple[np.ndarray, SourceInfo]:
    with open_source(SourceSpec(path=str(path), **spec), Path(), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


def rows_flipped(info: SourceInfo) -> np.ndarray:
    """World (RAS) from index, for the same voxels with their rows in reverse order, as dcm2niix writes them."""
    flip = np.eye(4)
    flip[1, 1], flip[1, 3] = -1.0, info.grid.shape_zyx[1] - 1
    return LPS_FROM_RAS @ info.grid.world_from_index @ flip


def test_the_oblique_head_has_its_recorded_geometry_and_values(scans) -> None:
    voxels, info = read(scans / "mr_t1_studyforrest")
    assert voxels.shape == info.grid.shape_zyx == (384, 384, 274)
    assert (voxels.dtype, voxels.min(), voxels.max()) == (np.int16, 0, 278)
    assert info.grid.spacing_mm_zyx == pytest.approx((0.6666667, 0.6666667, 0.6999878), abs=1e-7)
    tilt_deg = np.degrees(np.arccos(info.grid.direction[2][2]))
    assert tilt_deg == pytest.approx(7.68, abs=0.01)
    assert (info.modality, info.slope, info.intercept) == ("MR", 1.0, 0.0)
    # 32-bit floats: 2^-24 of 175 mm.
    np.testing.assert_allclose(rows_flipped(info), STUDYFORREST_AFFINE_RAS, rtol=0, atol=1.1e-5)


@pytest.mark.skipif(which("dcm2niix") is None, reason="dcm2niix is not installed; recorded numbers are tested above")
@pytest.mark.parametrize("name", ["mr_t1_studyforrest", "decubitus_hfp_sag", "dicom_transfer_syntaxes/In/1.dcm"])
def test_voxels_and_places_equal_those_of_dcm2niix(scans, tmp_path, name) -> None:
    single = ["-s", "y"] if name.endswith(".dcm") else []
    subprocess.run(["dcm2niix", "-z", "n", "-b", "n", "-f", "out", "-o", tmp_path, *single, scans / name], check=True)
    theirs = nibabel.load(tmp_path / "out.nii")
    their_world = LPS_FROM_RAS @ theirs.affine
    voxels, info = read(scans / name)
    index = np.linalg.inv(their_world) @ info.grid.world_from_index
    # Our axes are theirs, some in reverse: a signed permutation, up to 32-bit floats over 384 voxels.
    np.testing.assert_allclose(index[:3, :3], np.round(index[:3, :3]), atol=1e-5)
    np.testing.assert_allclose(index[:3, 3], np.round(index[:3, 3]), atol=1e-3)
    ours = voxels.transpose(2, 1, 0)
    for axis in range(3):
        assert abs(round(index[axis, axis])) == 1
        if index[axis, axis] < 0:
            ours = np.flip(ours, axis)
    assert np.array_equal(ours, np.asarray(theirs.dataobj))


def test_the_tilted_phantom_is_refused_with_its_angle_and_true_gap(scans) -> None:
    with pytest.raises(VolprepError) as error:
        read(scans / "ct_phantom_tilt-18.5")
    assert error.value.code == "VP2007"
    assert "-18.50° about the rows" in str(error.value)
    assert "2.371 mm apart along their normal, but 2.500 mm" in str(error.value)


def test_the_pitch_of_the_decubitus_scan_is_not_its_slice_thickness(scans) -> None:
    voxels, info = read(scans / "decubitus_hfp_sag")
    assert voxels.shape == (35, 256, 256)
    # Positions are stored in 32-bit precision, which at 80 mm is 4e-6 mm.
    assert info.grid.spacing_mm_zyx == pytest.approx((4.8, 1.015625, 1.015625), abs=1e-6)
    np.testing.assert_array_equal(info.grid.direction, [[0, 0, -1], [1, 0, 0], [0, -1, 0]])
    assert (voxels.min(), voxels.max()) == (0, 1839)


def test_nine_files_in_seven_transfer_syntaxes_hold_one_picture(scans) -> None:
    reference = nibabel.load(scans / "dicom_transfer_syntaxes" / "Ref_1.nii")
    expected = np.asarray(reference.dataobj).T[:, ::-1]
    syntaxes = set()
    for file in sorted((scans / "dicom_transfer_syntaxes" / "In").iterdir()):
        voxels, info = read(file)
        assert np.array_equal(voxels, expected), file.name
        # The reference was summed up in 32-bit floats, from the corner of the mosaic at -662 mm.
        np.testing.assert_allclose(rows_flipped(info), reference.affine, rtol=0, atol=662 * 2**-23)
        syntaxes.add(read_slices(file)[0].pixels.transfer_syntax)
    assert len(syntaxes) == 7


@pytest.mark.parametrize("name", COMPRESSED)
def test_compressed_series_equal_their_references(scans, name) -> None:
    folder = scans / "dicom_compressed_series" / f"compressed_{name}"
    voxels, info = read(folder / "001")
    truth = nibabel.load(folder / "001_ground_truth.nii.gz")
    # Its slices run from the right to the left, as ours do, with i along columns and j along rows.
    index = np.linalg.inv(LPS_FROM_RAS @ truth.affine) @ info.grid.world_from_index
    np.testing.assert_allclose(index, np.round(index), atol=1e-3)
    z, y, x = np.indices(voxels.shape)
    i, j, k, _ = np.round(index).astype(int) @ np.stack([x, y, z, np.ones_like(x)]).reshape(4, -1)
    assert np.array_equal(np.asarray(truth.dataobj)[i, j, k], voxels.ravel())


def test_a_colour_series_is_refused(scans) -> None:
    with pytest.raises(VolprepError, match="VP1035"):
        read(scans / "dicom_compressed_series" / "rgb")


def test_the_odd_sized_head_has_its_recorded_shape(scans) -> None:
    voxels, info = read(scans / "nifti_ch2" / "ch2.nii.gz")
    assert voxels.shape == (181, 217, 181)
    assert voxels.dtype == np.uint8
    assert info.grid.origin_mm_xyz == (90.0, 125.0, -71.0)


def test_the_oblique_nifti_head_lies_where_its_affine_puts_it(scans) -> None:
    file = scans / "flair_pair" / "FLAIR.nii.gz"
    voxels, info = read(file)
    theirs = nibabel.load(file)
    np.testing.assert_allclose(info.grid.world_from_index, LPS_FROM_RAS @ theirs.affine, atol=1e-5)
    assert np.array_equal(voxels.T, np.asarray(theirs.dataobj))


def test_48_storage_orders_hold_one_volume(scans) -> None:
    files = sorted((scans / "orient48").rglob("*.nii.gz"))
    assert len(files) == 48
    digests = set()
    for file in files:
        voxels, info = read(file)
        # Into the patient's axes: sort the index axes by the world axis that each follows, and turn falling ones.
        direction = np.array(info.grid.direction)
        follows = np.abs(direction).argmax(axis=0)
        world = voxels.transpose(2, 1, 0).transpose(np.argsort(follows))
        rising = direction[follows, range(3)] > 0
        world = np.flip(world, [axis for axis in range(3) if not rising[np.argsort(follows)[axis]]])
        digests.add(hashlib.sha256(np.ascontiguousarray(world).tobytes()).hexdigest())
    assert len(digests) == 1


def test_the_engine_reads_the_same_packed_and_unpacked(scans, tmp_path) -> None:
    packed = scans / "engine_pair" / "data" / "engine_256x256x128_uint8.raw.gz"
    layout = RawLayout(shape_zyx=(128, 256, 256), dtype="uint8")
    unpacked = tmp_path / "engine.raw"
    unpacked.write_bytes(gzip.decompress(packed.read_bytes()))
    voxels, _ = read(packed, raw=layout)
    assert np.array_equal(voxels, read(unpacked, raw=layout)[0])
    assert hashlib.sha256(voxels.tobytes()).hexdigest() == hashlib.sha256(unpacked.read_bytes()).hexdigest()
    assert voxels.max() == 255
