"""Volumes as research programs write them: NumPy arrays, FreeSurfer, Analyze, and NIfTI in two files."""

import gzip
import zipfile
from pathlib import Path

import nibabel
import numpy as np
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import format_of, open_source
from volprep_formats.source import ArrayLayout, SourceInfo, SourceSpec

LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])
TYPES = ["uint8", "int16", "float32"]


def read(path: Path, **told: object) -> tuple[np.ndarray, SourceInfo]:
    with open_source(SourceSpec(path=str(path), **told), Path(), Silent()) as source:
        depth = source.info.grid.shape_zyx[0]
        half = depth // 2
        slabs = [source.read_slab(0, half), source.read_slab(half, depth)] if half else [source.read_slab(0, depth)]
        return np.concatenate(slabs), source.info


def refusal(path: Path, **told: object) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        read(path, **told)
    return error.value


def noise(dtype: str = "int16", shape: tuple[int, ...] = (5, 4, 3)) -> np.ndarray:
    return np.random.default_rng(8).integers(0, 200, shape).astype(dtype)


def oblique() -> np.ndarray:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    affine = np.eye(4)
    affine[:3, :3] = turn * (0.5, 2.0, 1.25)
    affine[:3, 3] = (7.0, -9.0, 30.0)
    return affine


def check_places(info: SourceInfo, affine_ras: np.ndarray) -> None:
    grid = info.grid
    for index in ((0, 0, 0), (1, 0, 0), (0, 2, 0), (2, 1, 3)):
        steps = np.array(index) * grid.spacing_mm_zyx[::-1]
        ours = np.array(grid.origin_mm_xyz) + np.array(grid.direction) @ steps
        theirs = LPS_FROM_RAS @ (affine_ras @ [*index, 1])[:3]
        np.testing.assert_allclose(ours, theirs, atol=1e-4)


@pytest.mark.parametrize("suffix", [".mgh", ".mgz"])
@pytest.mark.parametrize("dtype", [*TYPES, "int32"])
def test_a_freesurfer_volume_lies_where_its_header_says(tmp_path, suffix, dtype) -> None:
    voxels, affine = noise(dtype), oblique()
    nibabel.save(nibabel.MGHImage(voxels, affine), tmp_path / f"a{suffix}")
    ours, info = read(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(ours, voxels.T)
    check_places(info, affine)
    assert info.format == "mgh"


def test_one_of_several_freesurfer_volumes_is_chosen(tmp_path) -> None:
    voxels = noise(shape=(5, 4, 3, 2))
    nibabel.save(nibabel.MGHImage(voxels, np.eye(4)), tmp_path / "a.mgz")
    np.testing.assert_array_equal(read(tmp_path / "a.mgz", volume=2)[0], voxels[..., 1].T)
    assert refusal(tmp_path / "a.mgz").code == "VP1021"


def test_a_freesurfer_volume_without_a_place_says_so(tmp_path) -> None:
    nibabel.save(nibabel.MGHImage(noise(), oblique()), tmp_path / "a.mgh")
    data = bytearray((tmp_path / "a.mgh").read_bytes())
    data[28:30] = b"\0\0"
    (tmp_path / "a.mgh").write_bytes(data)
    _, info = read(tmp_path / "a.mgh")
    assert "does not say how the volume lies" in info.remarks[0]
    # FreeSurfer's own words: x to the left, y down, z to the front, in steps of 1 mm, with the centre at 0.
    centre = np.array([5, 4, 3]) / 2
    columns = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    check_places(info, np.block([[columns, -(columns @ centre)[:, None]], [np.eye(4)[3]]]))


@pytest.mark.parametrize("dtype", TYPES)
def test_a_nifti_pair_is_read_from_either_of_its_files(tmp_path, dtype) -> None:
    voxels, affine = noise(dtype), oblique()
    nibabel.save(nibabel.Nifti1Pair(voxels, affine), tmp_path / "a.hdr")
    for name in ("a.hdr", "a.img"):
        ours, info = read(tmp_path / name)
        np.testing.assert_array_equal(ours, voxels.T)
        check_places(info, affine)
        assert info.format == "nifti"
    (tmp_path / "a.img").unlink()
    assert refusal(tmp_path / "a.hdr").code == "VP1006"


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("order", ["<", ">"])
def test_an_analyze_pair_is_read_with_its_spacing_and_says_that_it_has_no_orientation(tmp_path, dtype, order) -> None:
    voxels = noise(dtype)
    header = nibabel.AnalyzeHeader(endianness=order)
    header.set_data_dtype(dtype)
    picture = nibabel.AnalyzeImage(voxels, None, header)
    picture.header.set_zooms((0.5, 2.0, 1.25))
    nibabel.save(picture, tmp_path / "a.hdr")
    ours, info = read(tmp_path / "a.img")
    np.testing.assert_array_equal(ours, voxels.T)
    assert info.grid.spacing_mm_zyx == (1.25, 2.0, 0.5)
    assert "no orientation" in info.remarks[0]
    # nibabel lays x from right to left, too; it puts the centre at 0, where the format says nothing.
    assert np.array(info.grid.direction) @ [1, 0, 0] == pytest.approx([1, 0, 0])


def test_the_factor_that_spm_writes_is_used(tmp_path) -> None:
    picture = nibabel.Spm99AnalyzeImage(noise("float32") / 8, np.eye(4))
    picture.header.set_data_dtype("int16")
    nibabel.save(picture, tmp_path / "a.hdr")
    ours, info = read(tmp_path / "a.hdr")
    theirs = np.asarray(picture.dataobj)
    np.testing.assert_allclose(info.slope * ours.astype(np.float64) + info.intercept, theirs.T, atol=info.slope)


@pytest.mark.parametrize("dtype", [*TYPES, "uint16", "float64", ">i2"])
def test_an_array_has_the_axes_z_y_x_and_the_spacing_of_the_scene(tmp_path, dtype) -> None:
    voxels = noise(dtype)
    np.save(tmp_path / "a.npy", voxels)
    ours, info = read(tmp_path / "a.npy", array=ArrayLayout(spacing_mm_zyx=(2.0, 1.0, 0.5)))
    np.testing.assert_array_equal(ours, voxels)
    assert (info.grid.shape_zyx, info.grid.spacing_mm_zyx) == (voxels.shape, (2.0, 1.0, 0.5))
    assert info.remarks == ((("64-bit floating-point voxels are read as 32-bit ones"),) if dtype == "float64" else ())
    assert "1 mm" in read(tmp_path / "a.npy")[1].remarks[0]


def test_an_array_of_truth_values_is_one_of_0_and_1(tmp_path) -> None:
    mask = noise("uint8") > 9
    np.save(tmp_path / "mask.npy", mask)
    np.savez(tmp_path / "mask.npz", mask=mask)
    for name in ("mask.npy", "mask.npz"):
        ours, info = read(tmp_path / name)
        np.testing.assert_array_equal(ours, mask)
        assert info.stored_type == "uint8"


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_one_array_of_an_archive_is_chosen_by_its_name(tmp_path, save) -> None:
    ct, mask = noise("int16"), noise("uint8")
    save(tmp_path / "a.npz", ct=ct, mask=mask)
    np.testing.assert_array_equal(read(tmp_path / "a.npz", array=ArrayLayout(name="mask"))[0], mask)
    refused = refusal(tmp_path / "a.npz")
    assert (refused.code, "ct, mask" in str(refused)) == ("VP1284", True)
    assert refusal(tmp_path / "a.npz", array=ArrayLayout(name="pet")).code == "VP1284"


def test_arrays_that_are_no_volumes_are_refused(tmp_path) -> None:
    np.save(tmp_path / "flat.npy", noise(shape=(4, 4)))
    np.save(tmp_path / "complex.npy", noise().astype(np.complex64))
    np.save(tmp_path / "objects.npy", np.array([[[{}]]], object), allow_pickle=True)
    np.save(tmp_path / "columns.npy", np.asfortranarray(noise()))
    assert [refusal(tmp_path / f"{name}.npy").code for name in ("flat", "complex", "objects", "columns")] == [
        "VP1282",
        "VP1282",
        "VP1282",
        "VP1283",
    ]


def cut(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def test_a_file_cut_off_anywhere_is_refused(tmp_path) -> None:
    """Each format at every length, with the code of what it is; what is too short to be known is no format at all."""
    nibabel.save(nibabel.MGHImage(noise("uint8", (3, 2, 2)), np.eye(4)), tmp_path / "whole.mgh")
    np.save(tmp_path / "whole.npy", noise("uint8", (3, 2, 2)))
    np.savez_compressed(tmp_path / "whole.npz", noise("uint8", (3, 2, 2)))
    for suffix, last in ((".mgh", 284 + 12), (".npy", None), (".npz", None)):
        whole = (tmp_path / f"whole{suffix}").read_bytes()
        for length in range(len(whole[:last])):
            code = refusal(cut(tmp_path / f"cut{suffix}", whole[:length])).code
            assert code in {"VP1002", "VP1008", "VP1280", "VP1281", "VP1282"}, (suffix, length)


def test_an_archive_that_unpacks_to_less_than_it_says_is_refused(tmp_path) -> None:
    np.save(tmp_path / "a.npy", noise())
    whole = (tmp_path / "a.npy").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("a.npy", whole[:-9])
    assert refusal(tmp_path / "a.npz").code == "VP1008"


@pytest.mark.parametrize("place", [b"PK\1\2", b"PK\3\4"])
def test_an_archive_whose_names_are_no_utf_8_is_refused(tmp_path, place: bytes) -> None:
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive, archive.open("volume-ü.npy", "w") as file:
        np.save(file, noise())
    data = bytearray((tmp_path / "a.npz").read_bytes())
    data[data.index("ü".encode(), data.index(place))] = 0x81
    assert refusal(cut(tmp_path / "a.npz", bytes(data))).code == "VP1281"


def test_an_mgz_that_is_cut_off_is_refused(tmp_path) -> None:
    nibabel.save(nibabel.MGHImage(noise("uint8", (30, 20, 20)), np.eye(4)), tmp_path / "a.mgh")
    packed = gzip.compress((tmp_path / "a.mgh").read_bytes()[: 284 + 12000])
    for length in (20, 200, 4000):
        assert refusal(cut(tmp_path / "a.mgz", packed[:length])).code in {"VP1005", "VP1008", "VP1002"}


def test_the_format_of_each_is_known_without_a_scene(tmp_path) -> None:
    nibabel.save(nibabel.MGHImage(noise(), np.eye(4)), tmp_path / "a.mgz")
    nibabel.save(nibabel.AnalyzeImage(noise(), np.eye(4)), tmp_path / "b.hdr")
    np.save(tmp_path / "c.npy", noise())
    np.savez(tmp_path / "d.npz", noise())
    names = {"a.mgz": "mgh", "b.hdr": "analyze", "b.img": "analyze", "c.npy": "npy", "d.npz": "npy"}
    assert {name: format_of(tmp_path / name) for name in names} == names


def test_the_origin_that_spm_writes_is_the_voxel_at_zero(tmp_path) -> None:
    header = nibabel.Spm99AnalyzeHeader()
    header.set_data_dtype("int16")
    header.set_data_shape((5, 4, 3))
    header.set_zooms((0.5, 2.0, 1.25))
    for origin, is_used in (((4, 2, 3), True), ((0, 0, 0), False), ((30000, 2, 3), False)):
        header["origin"][:3] = origin
        (tmp_path / "a.hdr").write_bytes(bytes(header.binaryblock))
        (tmp_path / "a.img").write_bytes(noise().tobytes())
        _, info = read(tmp_path / "a.hdr")
        assert any("origin" in remark for remark in info.remarks) == is_used
        if is_used:
            check_places(info, nibabel.load(tmp_path / "a.hdr").affine)
