"""Which reader opens what, and settings that fit none."""

import errno
import gzip
import os
from contextlib import nullcontext
from math import prod
from pathlib import Path

import numpy as np
import pytest
from dicom_files import save, save_all, stack
from zarr_stores import multiscales, write_store

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import READERS, open_source
from volprep_formats.readers.pictures import kinds as picture_kinds
from volprep_formats.source import RawLayout, SourceSpec

LAYOUT = RawLayout(shape_zyx=(1, 2, 3), dtype="uint8")


def refusal(base: Path, **spec) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        open_source(SourceSpec(**spec), base, Silent())
    return error.value


def opened_format(base: Path, **spec) -> str:
    with open_source(SourceSpec(**spec), base, Silent()) as source:
        return source.info.format


def test_a_relative_path_starts_at_the_base_and_an_absolute_one_does_not(tmp_path) -> None:
    save_all(stack(3), tmp_path / "scans" / "head")
    assert opened_format(tmp_path / "scans", path="head") == "dicom"
    assert opened_format(Path("/nowhere"), path=str(tmp_path / "scans" / "head")) == "dicom"


def test_formats_are_known_by_content_whatever_the_names(tmp_path) -> None:
    import nibabel

    nibabel.save(nibabel.Nifti1Image(np.zeros((2, 2, 2), np.uint8), np.eye(4)), tmp_path / "a.nii")
    (tmp_path / "picture").write_bytes((tmp_path / "a.nii").read_bytes())
    (tmp_path / "packed").write_bytes(gzip.compress((tmp_path / "a.nii").read_bytes()))
    image = stack(1)[0]
    image.SliceThickness = "1"
    save(image, tmp_path / "slice.txt")
    assert [opened_format(tmp_path, path=name) for name in ("picture", "packed", "slice.txt")] == [
        "nifti",
        "nifti",
        "dicom",
    ]


def test_a_layout_makes_a_file_raw(tmp_path) -> None:
    (tmp_path / "data").write_bytes(bytes(6))
    assert opened_format(tmp_path, path="data", raw=LAYOUT) == "raw"


def test_a_missing_path_is_refused(tmp_path) -> None:
    error = refusal(tmp_path, path="none")
    assert error.code == "VP1001"
    assert str(tmp_path / "none") in str(error)


def test_a_folder_that_cannot_be_looked_through_is_refused(tmp_path, monkeypatch) -> None:
    (tmp_path / "scan").mkdir()
    (tmp_path / "scan" / "1.png").write_bytes(b"")

    def denied(folder: Path) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder / "private"))

    monkeypatch.setattr(picture_kinds, "files_below", denied)
    error = refusal(tmp_path, path="scan")
    assert (error.code, error.fields["path"]) == ("VP1003", str(tmp_path / "scan" / "private"))


@pytest.mark.parametrize(
    "data",
    [b"", b"just text", b"\x1f\x8b broken gzip", gzip.compress(b"x" * 400, mtime=0)],
    ids=["empty", "text", "broken", "packed"],
)
def test_a_file_of_no_known_format_is_refused_with_those_that_are(tmp_path, data) -> None:
    (tmp_path / "data").write_bytes(data)
    error = refusal(tmp_path, path="data")
    assert error.code == "VP1002"
    assert all(reader.name in str(error) for reader in READERS)


def test_raw_without_a_layout_is_refused(tmp_path) -> None:
    (tmp_path / "data").write_bytes(bytes(6))
    assert refusal(tmp_path, path="data", format="raw").code == "VP1010"


@pytest.mark.parametrize(
    ("spec", "key"), [({"format": "nifti", "raw": LAYOUT}, "raw"), ({"raw": LAYOUT, "series": "1.2"}, "series")]
)
def test_settings_of_another_format_are_refused(tmp_path, spec, key) -> None:
    (tmp_path / "data").write_bytes(bytes(6))
    error = refusal(tmp_path, path="data", **spec)
    assert (error.code, error.fields["key"]) == ("VP1004", key)


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("format_name", [reader.name for reader in READERS])
def test_a_folder_or_file_of_the_wrong_kind_is_refused_by_every_reader(tmp_path, format_name) -> None:
    (tmp_path / "text").write_text("no volume")
    raw = LAYOUT if format_name == "raw" else None
    # What is wrong with a package has the codes of packages, wherever it is read.
    codes = "VP4" if format_name == "volpkg" else "VP1"
    assert refusal(tmp_path, path="text", format=format_name, raw=raw).code.startswith(codes)
    (tmp_path / "folder").mkdir()
    assert refusal(tmp_path, path="folder", format=format_name, raw=raw).code.startswith(codes)


@pytest.mark.parametrize(
    ("name", "head", "what"),
    [
        ("a.stl", b"solid cube\nfacet normal 0 0 1\n", "an STL mesh"),
        ("b.stl", bytes(84), "an STL mesh"),
        ("c.ply", b"ply\nformat ascii 1.0\n", "a PLY mesh"),
        ("d.vtk", b"# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 8 float\n", "a VTK mesh"),
        ("e.vtp", b'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="0.1">', "a VTK mesh"),
        ("f.dcm.gz", gzip.compress(bytes(128) + b"DICM" + bytes(50), mtime=0), "a DICOM file packed by gzip"),
        ("g.gz", gzip.compress(b"II*\0" + bytes(124) + b"DICM" + bytes(50), mtime=0), "a DICOM file packed by gzip"),
        ("g.dcm", b"\x08\0\5\0CS\n\0ISO_IR 100", "a DICOM file without its header"),
        ("h.dcm", b"\x08\0\5\0\n\0\0\0ISO_IR 100", "a DICOM file without its header"),
        ("i.dcm", b"\0\x08\0\5CS\0\nISO_IR 100", "a DICOM file without its header"),
        ("j.dcm", b"\x08\0\0\0\4\0\0\0\x80\0\0\0\x08\0\x16\0", "a DICOM file without its header"),
        ("k.dcm", b"\2\0\0\0UL\4\0\xc0\0\0\0", "a DICOM file without its header"),
        ("f.trk", b"TRACK\0" + bytes(50), "a file of streamlines"),
        ("f.h5", b"\x89HDF\r\n\x1a\n" + bytes(50), "an HDF5 file"),
        ("f.nc", b"CDF\2" + bytes(50), "a NetCDF file"),
        ("g.par", b"# === DATA DESCRIPTION FILE ====", "Philips PAR/REC"),
        ("h.czi", b"ZISRAWFILE" + bytes(40), "Zeiss CZI"),
        ("i.zip", b"PK\3\4" + bytes(40), "a zip archive"),
        ("j.mat", b"MATLAB 5.0 MAT-file, Platform", "a MATLAB file"),
        ("k.pdf", b"%PDF-1.7\n", "a PDF document"),
        ("l.nvdb", b"NanoVDB0" + bytes(40), "a NanoVDB file"),
        ("m.vol", b"HSF-OCT-103" + bytes(40), "a Heidelberg OCT volume"),
    ],
)
def test_what_no_reader_knows_is_named_with_a_way_to_a_volume(tmp_path, name, head, what) -> None:
    (tmp_path / name).write_bytes(head)
    error = refusal(tmp_path, path=name)
    assert (error.code, what in str(error)) == ("VP1289", True)
    assert len(str(error).split("which is not read. ")[1]) > 20


def test_a_series_of_a_file_that_is_not_dicom_is_a_setting_of_another_format(tmp_path) -> None:
    np.save(tmp_path / "a.npy", np.zeros((3, 4, 5), np.uint8))
    assert refusal(tmp_path, path="a.npy", series="2").code == "VP1004"


def test_an_address_in_place_of_a_file_is_told_as_such_and_without_its_secrets(tmp_path) -> None:
    error = refusal(tmp_path, path="https://user:SECRET@host/scan.nii?sig=SECRET")
    assert error.code == "VP1306"
    assert "https://***@host/scan.nii?***: this command reads files of this machine" in str(error)


def test_a_small_file_of_a_very_long_axis_is_refused_before_they_are_read(tmp_path):
    header = "NRRD0004\ntype: {}\ndimension: 3\nsizes: {}\nencoding: gzip\nendian: little\n\n"
    for kind, size_bytes in (("uint8", 1), ("int32", 4)):
        for sizes, is_sound in (("1 1 70000", False), ("1 1 60000", True), ("1 300000 1", False), ("90000 1 1", True)):
            file = tmp_path / "thread.nrrd"
            voxels = bytes(prod(map(int, sizes.split())) * size_bytes)
            file.write_bytes(header.format(kind, sizes).encode() + gzip.compress(voxels))
            with nullcontext() if is_sound else pytest.raises(VolprepError, match="VP1310"):
                assert opened_format(tmp_path, path=str(file)) == "nrrd"
    store = write_store(tmp_path / "s.zarr", [np.ones((70_000, 1, 1), np.uint8)], multiscales("zyx"), 2)
    with pytest.raises(VolprepError, match="VP1310"):
        opened_format(tmp_path, path=str(store))
