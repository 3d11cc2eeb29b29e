"""A package as one zip: what a folder is, in one file that can be mapped, and never two things to two programs."""

import io
import json
import mmap
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import volprep

from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST, names_in
from volprep_formats.package.storage.single_file import ALIGNMENT, places, write_single_file
from volprep_formats.progress import Silent


def zipped(folder: Path) -> bytes:
    file = io.BytesIO()
    write_single_file(folder, names_in(folder), file, Silent())
    return file.getvalue()


@pytest.fixture
def one(sealed: Path, tmp_path: Path) -> Path:
    path = tmp_path / "one.volpkg.zip"
    path.write_bytes(zipped(sealed))
    return path


def test_it_reads_like_the_folder(sealed: Path, one: Path) -> None:
    package = Package.open(one)
    assert package.manifest == Package.open(sealed).manifest
    for record in package.manifest.files:
        assert package.read_bytes(record.path) == (sealed / record.path).read_bytes()
    assert check(one) == []


def test_every_file_can_be_mapped_where_it_is_and_the_manifest_comes_first(sealed: Path, one: Path) -> None:
    found = places(one)
    assert sorted(found) == names_in(sealed)
    assert min(found, key=lambda name: found[name]) == MANIFEST
    with one.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as memory:
        for name, (start, size, _) in found.items():
            assert start % ALIGNMENT == 0
            assert memory[start : start + size] == (sealed / name).read_bytes()


def test_unzipping_gives_the_folder_back(sealed: Path, one: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(one) as archive:
        assert archive.testzip() is None
        archive.extractall(tmp_path / "back.volpkg")
    assert {name: (tmp_path / "back.volpkg" / name).read_bytes() for name in names_in(tmp_path / "back.volpkg")} == {
        name: (sealed / name).read_bytes() for name in names_in(sealed)
    }


def test_the_same_package_gives_the_same_bytes(sealed: Path, one: Path) -> None:
    names = names_in(sealed)
    file = io.BytesIO()
    write_single_file(sealed, names[::-1], file, Silent())
    assert file.getvalue() == one.read_bytes()


@pytest.mark.parametrize("large", [False, True])
def test_files_of_any_size_are_aligned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, large: bool) -> None:
    if large:
        # What is written of a file from here on is what zips have for files beyond 4 GB.
        monkeypatch.setattr(zipfile, "ZIP64_LIMIT", 20)
    sizes = {f"f{'x' * n}.bin": n for n in (1, 2, 5, 17, 18, 19, 20, 21, 63, 64, 65, 200)}
    for name, size in sizes.items():
        (tmp_path / name).write_bytes(bytes(range(size)))
    target = tmp_path / "out.zip"
    target.write_bytes(zipped(tmp_path))
    assert {name: place.size_bytes for name, place in places(target).items()} == sizes
    assert all(place.start_bytes % ALIGNMENT == 0 for place in places(target).values())


def _archive(*entries: tuple[str, bytes], method: int = zipfile.ZIP_STORED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, data in entries:
            archive.writestr(zipfile.ZipInfo(name), data, method)
    return file.getvalue()


def _changed(data: bytes, at: int, new: bytes) -> bytes:
    return data[:at] + new + data[at + len(new) :]


def _overlapping() -> bytes:
    """The second entry's header lies within the first entry's bytes."""
    inner = _archive(("b", b"12345678"))[:-22]
    head = inner[: inner.index(b"PK\x01\x02")]
    data = _archive(("a", b"--" + head + b"--"), ("b", b"12345678"))
    central = data.rindex(b"PK\x01\x02")
    return _changed(data, central + 42, struct.pack("<I", data.index(head)))


def _doubled() -> bytes:
    with pytest.warns(UserWarning, match="Duplicate name"):
        return _archive((MANIFEST, b"{}"), (MANIFEST, b"[]"))


def _sizes_behind() -> bytes:
    """A zip as a pipe gets it."""

    class Pipe(io.BytesIO):
        def seekable(self) -> bool:
            return False

        def tell(self) -> int:
            raise io.UnsupportedOperation

    file = Pipe()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(zipfile.ZipInfo(MANIFEST), b"{}")
    return file.getvalue()


def _with_crc(one: Path, name: str, crc: bytes) -> bytes:
    """The package with another CRC for a file, before its bytes and in the directory."""
    data = one.read_bytes()
    with zipfile.ZipFile(one) as archive:
        head = archive.getinfo(name).header_offset
    central = next(at for at in _found(data, b"PK\x01\x02") if data[at + 46 :].startswith(name.encode()))
    return _changed(_changed(data, head + 14, crc), central + 16, crc)


def _found(data: bytes, what: bytes) -> list[int]:
    return [at for at in range(len(data)) if data.startswith(what, at)]


@pytest.mark.parametrize("name", [MANIFEST, "textures/bone.ktx2", "preview.png"])
def test_a_file_whose_crc_lies_is_refused_though_its_digest_is_right(one: Path, tmp_path: Path, name: str) -> None:
    path = tmp_path / "lies.zip"
    path.write_bytes(_with_crc(one, name, b"\1\2\3\4"))
    assert [(finding.code, name in finding.summary) for finding in check(path)] == [("VP4061", True)]
    with pytest.raises(VolprepError, match="VP4061"):
        Package.open_any(path).read_bytes(name)


def _commented(comment: bytes) -> bytes:
    data = _archive((MANIFEST, b"{}"))
    return data[:-2] + struct.pack("<H", len(comment)) + comment


def _prefixed() -> bytes:
    """Text before the first file, and a directory that knows it."""
    file = io.BytesIO(b"#!/bin/sh\n")
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr(zipfile.ZipInfo(MANIFEST), b"{}")
    return file.getvalue()


def _with_gap() -> bytes:
    """A file that the directory does not name, between two that it names."""
    data = _archive((MANIFEST, b"{}"), ("a", b"1"), ("b", b"2"))
    central = data.index(b"PK\x01\x02", data.index(b"PK\x01\x02") + 4)
    after = data.index(b"PK\x01\x02", central + 4)
    end = data.rindex(b"PK\x05\x06")
    start = data.index(b"PK\x01\x02")
    tail = struct.pack("<4s4H2IH", b"PK\x05\x06", 0, 0, 2, 2, end - start - (after - central), start, 0)
    return data[:central] + data[after:end] + tail


def _with_file_comment() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        entry = zipfile.ZipInfo(MANIFEST)
        entry.comment = b"hidden"
        archive.writestr(entry, b"{}")
    return file.getvalue()


BAD = {
    "nothing": (lambda: b"", "too short for a zip"),
    "a head alone": (lambda: b"PK\x03\x04 and no more", "too short for a zip"),
    "cut off": (lambda: _archive((MANIFEST, b"{}"))[:-5], "not a zip"),
    "compressed": (lambda: _archive((MANIFEST, b"{}" * 500), method=zipfile.ZIP_DEFLATED), "is compressed"),
    "a name twice": (_doubled, "is there twice"),
    "on top of each other": (_overlapping, "does not end where the next file or the directory begins"),
    "another name at its place": (lambda: _changed(_archive((MANIFEST, b"{}")), 30, b"x"), "another name at its place"),
    "another CRC before it": (lambda: _changed(_archive((MANIFEST, b"{}")), 14, b"\0"), "has another CRC"),
    "another size before it": (lambda: _changed(_archive((MANIFEST, b"{}")), 22, b"\3"), "has another CRC, size"),
    "another packed size before it": (
        lambda: _changed(_archive((MANIFEST, b"{}")), 18, b"\1"),
        "has another CRC, size",
    ),
    "compressed by its head": (lambda: _changed(_archive((MANIFEST, b"{}")), 8, b"\x08"), "or kind at its place"),
    "encrypted by its head": (lambda: _changed(_archive((MANIFEST, b"{}")), 6, b"\1"), "or kind at its place"),
    "sizes behind it": (_sizes_behind, "has its sizes behind it"),
    "a comment": (lambda: _commented(b"more"), "end record is its last 22 bytes"),
    "another zip as its comment": (
        lambda: _commented(_archive((MANIFEST, b"[]"))),
        "does not end where its end record",
    ),
    "text before it": (lambda: b"#!/bin/sh\n" + _archive((MANIFEST, b"{}")), "does not end where its end record"),
    "text before it that its places count": (_prefixed, "does not begin at its first byte"),
    "a file between the files": (_with_gap, "does not end where the next file"),
    "a comment of a file": (_with_file_comment, "has a comment"),
    "bytes behind its directory": (lambda: _archive((MANIFEST, b"{}")) + b"1", "last 22 bytes"),
    "without a manifest": (lambda: _archive(("a", b"1")), "it has no manifest.json"),
}


@pytest.mark.parametrize("bad", BAD)
def test_what_two_programs_could_read_as_two_packages_is_refused(tmp_path: Path, bad: str) -> None:
    make, says = BAD[bad]
    path = tmp_path / "bad.zip"
    path.write_bytes(make())
    with pytest.raises(VolprepError, match=f"VP4002.*{says}") as refused:
        Package.open(path)
    assert refused.value.status is ExitStatus.PACKAGE


@pytest.mark.parametrize("name", ["../outside", "/etc/passwd", "textures/../../x", "left-over.txt"])
def test_what_the_manifest_does_not_name_is_found_and_never_read(sealed: Path, tmp_path: Path, name: str) -> None:
    files = [(each, (sealed / each).read_bytes()) for each in names_in(sealed)]
    path = tmp_path / "more.zip"
    path.write_bytes(_archive(*files, (name, b"1")))
    assert [finding.code for finding in check(path)] == ["VP4010"]
    with pytest.raises(VolprepError, match="VP4014"):
        Package.open_any(path).read_bytes(name)


def test_a_changed_texture_and_a_missing_one_are_found(sealed: Path, tmp_path: Path) -> None:
    files = {each: (sealed / each).read_bytes() for each in names_in(sealed)}
    name = "textures/bone.ktx2"
    path = tmp_path / "other.zip"
    path.write_bytes(_archive(*(files | {name: files[name][:-1] + b"\x01"}).items()))
    assert [finding.code for finding in check(path)] == ["VP4009"]
    del files[name]
    (tmp_path / "less.zip").write_bytes(_archive(*files.items()))
    assert [finding.code for finding in check(tmp_path / "less.zip")] == ["VP4007"]


@pytest.mark.long
def test_the_verb_writes_it_once_and_others_read_it(sealed: Path, tmp_path: Path) -> None:
    done = volprep("zip", sealed, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    target = sealed.with_name(f"{sealed.name}.zip")
    assert (told["file"], told["size_bytes"]) == (str(target), target.stat().st_size)
    assert target.read_bytes() == zipped(sealed)
    again = volprep("zip", sealed)
    assert again.returncode == ExitStatus.OUTPUT
    assert "VP1251" in again.stderr
    assert volprep("zip", sealed, "--force").returncode == 0
    assert volprep("validate", "--quick", target).returncode == 0
    assert "shells" in volprep("inspect", target).stdout
    twice = volprep("zip", target, "-o", tmp_path / "twice.zip")
    assert twice.returncode == ExitStatus.PACKAGE
    assert "VP4044" in twice.stderr
    levels = []
    for package in (sealed, target):
        file = tmp_path / f"{len(levels)}.raw"
        assert volprep("export", package, file).returncode == 0
        levels.append(np.fromfile(file, np.uint8))
    assert np.array_equal(*levels)
