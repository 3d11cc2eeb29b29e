"""What is no regular file, or changes while it is read: refused with a code, and at once."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import nibabel
import numpy as np
import pytest

from volprep.pipeline.origin import read_origin
from volprep.scene.profiles import load_profile
from volprep.scene.scene import load_scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import workers
from volprep_formats.progress import Silent
from volprep_formats.readers import channels_of, open_source
from volprep_formats.regular_files import read_regular
from volprep_formats.source import RawLayout, SourceSpec
from volprep_formats.transfer_files import read_transfer_file

from .subjects import SUBJECTS, Subject, sound_file

LONGEST_S = 10.0  # a reader that waits for a pipe waits for ever; a slow machine is not at fault


@contextmanager
def refused(*codes: str) -> Iterator[None]:
    began = time.monotonic()
    with pytest.raises(VolprepError) as caught:
        yield
    assert caught.value.code in codes
    assert time.monotonic() - began < LONGEST_S


def make_pipe(path: Path) -> None:
    os.mkfifo(path)


def make_link_to_a_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def make_link_to_a_pipe(path: Path) -> None:
    os.mkfifo(path.with_name("pipe"))
    path.symlink_to("pipe")


ODD = pytest.mark.parametrize("make", [make_pipe, make_link_to_a_device, make_link_to_a_pipe])


def read_scan(path: Path) -> None:
    open_source(SourceSpec(path=str(path)), Path(), Silent())


def read_raw_scan(path: Path) -> None:
    open_source(SourceSpec(path=str(path), raw=RawLayout(shape_zyx=(2, 2, 2), dtype="uint8")), Path(), Silent())


def read_profile(path: Path) -> None:
    load_profile(str(path), Path())


def read_origin_beside(path: Path) -> None:
    read_origin(path.with_name(path.name.removesuffix(".origin.json")))


def test_a_scene_whose_source_is_a_pipe_is_refused_at_once(tmp_path) -> None:
    os.mkfifo(tmp_path / "phantom.raw")
    with refused("VP1003"):
        open_source(SourceSpec(path="phantom.raw", format="raw"), tmp_path, Silent())


@ODD
@pytest.mark.parametrize(
    ("name", "read", "code"),
    [
        ("scan.nii", read_scan, "VP1003"),
        ("scan.raw", read_raw_scan, "VP1003"),
        ("scan.nii", channels_of, "VP1003"),
        ("scene.toml", load_scene, "VP3001"),
        ("profile.toml", read_profile, "VP3011"),
        ("points.vp", read_transfer_file, "VP3042"),
        ("a.volpkg.origin.json", read_origin_beside, "VP4043"),
    ],
)
def test_a_pipe_or_a_device_is_refused_at_once(tmp_path, make, name, read, code) -> None:
    make(tmp_path / name)
    with refused(code):
        read(tmp_path / name)


@ODD
def test_a_pipe_or_a_device_as_the_data_file_of_a_header_is_refused_at_once(tmp_path, make) -> None:
    make(tmp_path / "data.raw")
    header = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = data.raw\n"
    (tmp_path / "scan.mhd").write_text(header)
    with refused("VP1006"):
        read_scan(tmp_path / "scan.mhd")


@ODD
def test_a_pipe_or_a_device_among_pictures_is_ignored_or_refused(tmp_path, make) -> None:
    (tmp_path / "stack").mkdir()
    make(tmp_path / "stack" / "1.png")
    with refused("VP1003", "VP1030", "VP1160"):
        read_scan(tmp_path / "stack")


@ODD
def test_a_pipe_or_a_device_in_a_zarr_store_is_refused(tmp_path, make) -> None:
    (tmp_path / "scan.zarr").mkdir()
    make(tmp_path / "scan.zarr" / "zarr.json")
    (tmp_path / "scan.zarr" / ".zattrs").write_text("{}")
    with workers(), refused("VP1220", "VP1226"):
        read_scan(tmp_path / "scan.zarr")


@pytest.mark.parametrize(
    ("read", "name", "code"), [(load_scene, "a.toml", "VP3001"), (read_transfer_file, "a.vp", "VP3042")]
)
def test_a_text_file_without_end_is_refused_at_once(tmp_path, read, name, code) -> None:
    with (tmp_path / name).open("wb") as file:
        file.truncate(2**40)
    with refused(code):
        read(tmp_path / name)


def test_a_text_file_of_the_largest_size_is_read_whole(tmp_path) -> None:
    (tmp_path / "text").write_bytes(b"x" * 1000)
    assert read_regular(tmp_path / "text", 1000) == b"x" * 1000
    with pytest.raises(OSError, match="more than 999 bytes"):
        read_regular(tmp_path / "text", 999)


def test_a_folder_that_cannot_be_searched_is_refused_with_a_code(tmp_path, monkeypatch) -> None:
    def denied(_path: Path, **_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "stat", denied)
    with refused("VP1003"):
        read_scan(tmp_path / "locked" / "scan.nii")


def shrink(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def vanish(path: Path) -> None:
    path.unlink()


def vanish_cut(path: Path) -> None:
    shrink(path)
    vanish(path)


def become_a_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


FILES = [
    subject
    for subject in SUBJECTS
    if subject.name.startswith(("raw", "NIfTI-1", "NRRD", "MetaImage", "VTK", "TIFF", "PNG", "OME", "OpenEXR"))
]


@pytest.mark.long(keep=11)
@pytest.mark.parametrize("change", [shrink, vanish, vanish_cut, become_a_pipe])
@pytest.mark.parametrize("subject", FILES, ids=lambda subject: subject.name)
def test_a_file_that_changes_after_it_was_opened_gives_what_it_held_or_a_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, subject: Subject, change: Callable[[Path], None]
) -> None:
    from . import subjects

    path = tmp_path / f"scan{subject.suffix}"
    path.write_bytes(subject.pack(sound_file(subject)))
    opened = open_source
    whole = {}

    def open_and_change(*arguments: object) -> object:
        with opened(*arguments) as source:
            whole["voxels"] = source.read_slab(0, source.info.grid.shape_zyx[0])
        source = opened(*arguments)
        change(path)
        return source

    monkeypatch.setattr(subjects, "open_source", open_and_change)
    began = time.monotonic()
    with workers():
        try:
            subject.read(path)
        except VolprepError as error:
            assert not error.code.startswith("VP9")  # noqa: PT017 - it may be read as well
    assert whole
    assert time.monotonic() - began < 4 * LONGEST_S


def test_a_nifti_file_that_grows_while_it_is_read_gives_what_it_held(tmp_path: Path) -> None:
    path = tmp_path / "scan.nii"
    nibabel.save(nibabel.Nifti1Image(np.arange(24, dtype=np.int16).reshape(2, 3, 4), np.eye(4)), path)
    with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
        with path.open("ab") as file:
            file.write(bytes(1000))
        assert source.read_slab(0, 4).shape == (4, 3, 2)
