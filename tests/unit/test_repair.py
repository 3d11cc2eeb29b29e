"""Repairs on request: tilted and uneven series become volumes whose voxels lie where they should."""

import json
import math
import subprocess
from pathlib import Path
from shutil import which

import nibabel
import numpy as np
import pytest
from command_line import volprep
from dicom_files import image, save_all
from scipy import ndimage

from volprep.scan.repair import open_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_slices, open_source
from volprep_formats.repairs import GapRepair, TiltRepair
from volprep_formats.source import SourceInfo, SourceSpec, VolumeSource
from volprep_formats.uneven_source import UnevenSource

ROW, COLUMN = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, -1.0])
NORMAL = np.cross(ROW, COLUMN)
SPACING_YX = (1.5, 1.25)
SHAPE_YX = (9, 11)
FIELD = np.array([3.0, -2.0, 5.0])


def series(along_mm: list[float], tilt_deg_yx: tuple[float, float] = (0.0, 0.0), **attributes) -> list:
    """Slices of the field 7 + FIELD · world, as 32-bit floats."""
    images = []
    for along in along_mm:
        beside = [math.tan(math.radians(angle)) * along for angle in tilt_deg_yx]
        position = np.array([-40.0, 12.5, 80.0]) + NORMAL * along + COLUMN * beside[0] + ROW * beside[1]
        y, x = np.indices(SHAPE_YX)
        world = position + y[..., None] * SPACING_YX[0] * COLUMN + x[..., None] * SPACING_YX[1] * ROW
        data = image(
            np.zeros(SHAPE_YX, np.int16),
            position,
            orientation=np.concatenate((ROW, COLUMN)),
            spacing_mm_yx=SPACING_YX,
            BitsAllocated=32,
            **attributes,
        )
        del data.PixelData
        data.FloatPixelData = (7 + world @ FIELD).astype("<f4").tobytes()
        images.append(data)
    return images


def integers(values: list[int], along_mm: list[float], **attributes) -> list:
    return [
        image(np.full((2, 3), value, np.int16), (0, 0, z), **attributes)
        for value, z in zip(values, along_mm, strict=True)
    ]


def read(folder: Path, *repair: str) -> tuple[np.ndarray, SourceInfo]:
    with open_scan(SourceSpec(path=str(folder), repair=repair), Path(), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


def error_of_field(voxels: np.ndarray, info: SourceInfo) -> np.ndarray:
    """How far each voxel is from the field at the place where the grid puts it."""
    z, y, x = np.indices(voxels.shape)
    world = np.stack([x, y, z, np.ones_like(x)], axis=-1) @ info.grid.world_from_index.T
    return np.abs(voxels - 7 - world[..., :3] @ FIELD)


EVEN = [2.0 * k for k in range(8)]
HOLED = [0.0, 2.0, 4.0, 10.0, 12.0, 14.0]
UNEVEN = [0.0, 2.0, 4.1, 5.0, 7.3, 9.3, 11.3, 13.0]


@pytest.mark.parametrize("along_mm", [EVEN, HOLED, UNEVEN])
@pytest.mark.parametrize("tilt_deg_yx", [(0.0, 0.0), (-18.5, 0.0), (12.0, 7.0), (0.0, -25.0)])
def test_a_linear_field_is_found_at_the_place_of_every_voxel_that_a_slice_covers(
    tmp_path, along_mm, tilt_deg_yx
) -> None:
    save_all(series(along_mm, tilt_deg_yx), tmp_path)
    voxels, info = read(tmp_path, "gaps", "tilt")
    assert voxels.dtype == np.float32
    lowest = voxels.min()
    error = error_of_field(voxels, info)
    # Between two tilted neighbours, voxels near the edge mix with the padding. Inside, nothing but rounding to 32 bits.
    slope_yx = np.abs(np.tan(np.radians(tilt_deg_yx)))
    margin_y, margin_x = (math.ceil(6.0 * s / h) + 1 for s, h in zip(slope_yx, SPACING_YX, strict=True))
    tilted = [bool(s) for s in slope_yx]
    covered = (error < 0.5).mean()
    if not any(tilted):
        assert error.max() < 1e-4
    else:
        assert covered > 0.25
        assert voxels[0, 0, 0] == pytest.approx(lowest) or voxels[-1, 0, 0] == pytest.approx(lowest)
    for z in range(len(voxels)):
        here = error[z] < 1e-4
        rows, columns = (here.any(axis=1 - axis).sum() for axis in (0, 1))
        assert rows >= SHAPE_YX[0] - (margin_y if tilted[0] else 0)
        assert columns >= SHAPE_YX[1] - (margin_x if tilted[1] else 0)


def test_a_missing_slice_is_the_mean_of_its_neighbours_and_said_to_be(tmp_path) -> None:
    save_all(integers([10, 20, 45, 50], [0.0, 2.0, 6.0, 8.0]), tmp_path)
    voxels, info = read(tmp_path, "gaps")
    assert voxels[:, 1, 2].tolist() == [10, 20, 32, 45, 50], "32.5 rounds to the even neighbour"
    assert (voxels.dtype, info.grid.spacing_mm_zyx[0]) == (np.int16, 2.0)
    assert info.repairs == (GapRepair(slices_before=4, slices_after=5, usual_gap_mm=2.0, largest_gap_mm=4.0),)


def test_a_shear_of_half_a_pixel_is_halfway_between_neighbours(tmp_path) -> None:
    rows = np.array([[0, 8, 16]], np.int16).T
    save_all([image(rows, (0, 0.5 * z, z), RescaleSlope="2", RescaleIntercept="-3") for z in range(3)], tmp_path)
    voxels, info = read(tmp_path, "tilt")
    assert voxels[:, :, 0].tolist() == [[0, 8, 16, 0], [0, 4, 12, 8], [0, 0, 8, 16]]
    (repair,) = info.repairs
    assert isinstance(repair, TiltRepair)
    assert repair.about_rows_deg == pytest.approx(math.degrees(math.atan(0.5)))
    assert (repair.about_columns_deg, repair.added_rows, repair.added_columns, repair.padding) == (0.0, 1, 0, -3.0)


def test_the_padding_is_the_lowest_physical_value_where_the_slope_is_negative(tmp_path) -> None:
    rows = np.array([[1, 8, 16]], np.int16).T
    save_all([image(rows, (0, -float(z), z), RescaleSlope="-1", RescaleIntercept="0") for z in range(3)], tmp_path)
    voxels, info = read(tmp_path, "tilt")
    assert voxels[0, :, 0].tolist() == [16, 16, 1, 8, 16]
    assert voxels[2, :, 0].tolist() == [1, 8, 16, 16, 16]
    assert info.repairs[0].padding == -16.0
    assert info.grid.origin_mm_xyz == (0.0, -2.0, 0.0)


def test_slabs_of_a_repaired_volume_are_its_slices(tmp_path) -> None:
    save_all(series(UNEVEN, (10.0, 0.0)), tmp_path)
    whole, _ = read(tmp_path, "gaps", "tilt")
    with open_scan(SourceSpec(path=".", repair=("tilt", "gaps")), tmp_path, Silent()) as source:
        slabs = [source.read_slab(z, min(z + 3, len(whole))) for z in range(0, len(whole), 3)]
        assert source.read_slab(2, 2).shape == (0, *whole.shape[1:])
    assert np.array_equal(np.concatenate(slabs), whole)


@pytest.mark.parametrize(
    ("along_mm", "tilt_deg", "repair", "code"),
    [
        (HOLED, 0.0, (), "VP2014"),
        (HOLED, 0.0, ("tilt",), "VP2014"),
        (UNEVEN, 0.0, ("tilt",), "VP2015"),
        (EVEN, 9.0, (), "VP2007"),
        (EVEN, 9.0, ("gaps",), "VP2007"),
        (HOLED, 9.0, ("tilt",), "VP2014"),
        ([0.0, 1.0, 2.0, 60.0], 0.0, ("gaps",), "VP2016"),
        ([0.0, 30.0, 60.0], 60.0, ("tilt",), "VP2016"),
        ([0.0, 1e-3, 9e5], 0.0, ("gaps",), "VP2005"),
    ],
)
def test_what_was_not_allowed_or_would_invent_most_of_the_volume_is_refused(
    tmp_path, along_mm, tilt_deg, repair, code
) -> None:
    save_all(series(along_mm, (tilt_deg, 0.0)), tmp_path)
    with pytest.raises(VolprepError, match=code):
        read(tmp_path, *repair)


def test_a_sound_series_is_left_alone_by_repairs_that_are_allowed(tmp_path) -> None:
    save_all(series(EVEN), tmp_path)
    voxels, info = read(tmp_path, "gaps", "tilt")
    plain, plain_info = read(tmp_path)
    assert np.array_equal(voxels, plain)
    assert info == plain_info


def test_uneven_slices_cannot_be_taken_for_a_volume(tmp_path) -> None:
    save_all(series(HOLED), tmp_path)
    spec = SourceSpec(path=".", repair=("gaps",))
    with pytest.raises(VolprepError, match="VP2014"):
        open_source(spec, tmp_path, Silent())
    with open_slices(spec, tmp_path, Silent()) as slices:
        assert isinstance(slices, UnevenSource)
        assert not hasattr(slices, "info")
        assert slices.places.along_mm == pytest.approx(HOLED)


def test_a_source_without_slices_cannot_be_repaired(tmp_path) -> None:
    nibabel.Nifti1Image(np.zeros((2, 3, 4), np.int16), np.eye(4)).to_filename(tmp_path / "x.nii")
    with pytest.raises(VolprepError, match="VP1004"):
        read(tmp_path / "x.nii", "gaps")


def test_the_command_line_repairs_on_request_and_says_so(tmp_path) -> None:
    save_all(integers([10, 20, 45, 50], [0.0, 2.0, 6.0, 8.0]), tmp_path / "scan")
    refused = volprep("import", tmp_path / "scan", "-o", tmp_path / "x.volpkg")
    assert refused.returncode == 3
    assert 'source.repair = ["gaps"]' in refused.stderr
    assert volprep("import", tmp_path / "scan", "--repair", "holes", "-o", tmp_path / "x.volpkg").returncode == 2
    done = volprep("import", tmp_path / "scan", "--repair", "gaps", "-o", tmp_path / "x.volpkg", "--json")
    assert done.returncode == 0, done.stderr
    (repair,) = json.loads(done.stdout)["source"]["info"]["repairs"]
    assert (repair["kind"], repair["interpolation"], repair["slices_after"]) == ("gaps", "linear", 5)
    shown = volprep("inspect", tmp_path / "x.volpkg")
    assert "gaps, linear interpolation" in shown.stdout


# The tilted phantom


@pytest.fixture(scope="module")
def phantom(scans) -> tuple[np.ndarray, SourceInfo]:
    """The CT of a phantom with its gantry tilt of -18.5° removed."""
    return read(scans / "ct_phantom_tilt-18.5", "tilt")


def test_the_tilt_of_the_phantom_is_found_and_removed_with_its_true_gap(phantom) -> None:
    voxels, info = phantom
    assert voxels.shape == info.grid.shape_zyx == (54, 600, 512)
    assert info.grid.spacing_mm_zyx[0] == pytest.approx(2.371, abs=5e-4)
    (repair,) = info.repairs
    assert isinstance(repair, TiltRepair)
    assert repair.about_rows_deg == pytest.approx(-18.5, abs=1e-4)
    assert (repair.added_rows, repair.added_columns, repair.padding) == (88, 0, -1024.0)


def off_line_pixels(phantom: tuple[np.ndarray, SourceInfo], z0: int, z1: int, row: int, column: int) -> float:
    """How far the centres of a rod are from one line in the world."""
    voxels, info = phantom
    centres = []
    centre = (float(row), float(column))
    for z in range(z0, z1):
        labels, _ = ndimage.label(np.abs(voxels[z].astype(int) - 1118) < 60)
        own = labels == labels[round(centre[0]), round(centre[1])]
        centre = ndimage.center_of_mass(own)
        centres.append((info.grid.world_from_index @ [centre[1], centre[0], z, 1.0])[:3])
    points = np.array(centres) - np.mean(centres, axis=0)
    axis = np.linalg.svd(points)[2][0]
    beside = np.linalg.norm(points - np.outer(points @ axis, axis), axis=1)
    return float(beside.max() / info.grid.spacing_mm_zyx[1])


@pytest.mark.parametrize("rod", [(0, 11, 395, 248), (25, 32, 266, 284)])
def test_the_rods_of_the_phantom_are_straight(phantom, rod) -> None:
    assert off_line_pixels(phantom, *rod) < 0.5


@pytest.mark.skipif(which("dcm2niix") is None, reason="dcm2niix is not installed; the rods are tested above")
def test_the_straightened_phantom_equals_that_of_dcm2niix(scans, phantom, tmp_path) -> None:
    command = ["dcm2niix", "-z", "n", "-b", "n", "-f", "out", "-o", tmp_path, scans / "ct_phantom_tilt-18.5"]
    subprocess.run(command, check=True, capture_output=True)
    theirs = nibabel.load(tmp_path / "out_Tilt_1.nii")
    voxels, info = phantom
    index = np.linalg.inv(np.diag([-1.0, -1.0, 1.0, 1.0]) @ theirs.affine) @ info.grid.world_from_index
    np.testing.assert_allclose(index, [[1, 0, 0, 0], [0, -1, 0, 599], [0, 0, 1, 0], [0, 0, 0, 1]], atol=1e-3)
    ours = voxels.transpose(2, 1, 0)[:, ::-1].astype(np.float64) - 1024
    different = np.abs(ours - np.asarray(theirs.dataobj)) > 1.0
    # The row at the edge of what a slice covers is mixed with the padding here, and cut there.
    assert different.any(axis=0).sum(axis=0).max() <= 2


def test_a_repaired_source_is_a_source(tmp_path) -> None:
    save_all(series(HOLED), tmp_path)
    source: VolumeSource = open_scan(SourceSpec(path=".", repair=("gaps",)), tmp_path, Silent())
    with source as opened:
        assert opened is source
