"""The walk over plain DICOM headers finds what pydicom finds, or finds nothing, whatever has been done to the file."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pydicom.data
import pytest
from dicom_files import compressed, image, nested, read_slices, save
from dicom_walk import walked
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.tag import Tag
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    RLELossless,
)
from write_anew import write_anew

from volprep_formats import _dicom
from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom import file as dicom_file
from volprep_formats.readers.dicom.any_file import any_slices
from volprep_formats.readers.dicom.fields import PRIVATE_TAGS, TAGS
from volprep_formats.readers.dicom.header import interpreted, slice_image
from volprep_formats.readers.dicom.plain import plain_headers

from .mutations import mutation

PLAIN = (ExplicitVRLittleEndian, ImplicitVRLittleEndian, RLELossless)


def plain_image(*, depth: int = 2, private_bytes: int = 9000, **attributes) -> Dataset:
    """A slice with all that a plain file may have: sequences, private elements, long types.

    With a depth of 0 there is no sequence of undefined length.
    """
    data = image(np.arange(15 * 20, dtype=np.int16).reshape(15, 20), (1.0, 2.0, 3.0), RescaleSlope="2", **attributes)
    data.ReferencedStudySequence = nested(1)
    if depth:
        data.ReferencedImageSequence = nested(depth)
        data["ReferencedImageSequence"].is_undefined_length = True
    data.add_new(0x00290010, "LO", "SIEMENS CSA HEADER")
    data.add_new(0x00291010, "OB", bytes(private_bytes))
    data.add_new(0x00291020, "UN", b"anything")
    return data


def written(folder, syntax=ExplicitVRLittleEndian, data: Dataset | None = None):
    data = plain_image() if data is None else data
    return save(compressed(data, syntax) if syntax == RLELossless else data, folder / "slice", syntax)


def by_pydicom(path):
    with path.open("rb") as file:
        return any_slices(path, file, deflated=False)


def plain_header(path):
    (found,) = plain_headers([path])
    return found


def seen(slices):
    """Slices with errors that can be compared."""
    return tuple(replace(s, problem=None if s.problem is None else str(s.problem)) for s in slices)


@pytest.mark.parametrize("syntax", PLAIN, ids=lambda syntax: syntax.name)
def test_a_plain_file_needs_no_pydicom(tmp_path, monkeypatch, syntax) -> None:
    file = written(tmp_path, syntax, plain_image(depth=2 * (syntax != ImplicitVRLittleEndian)))
    expected = by_pydicom(file)
    monkeypatch.setattr(dicom_file, "_unusual_slices", lambda path: pytest.fail(f"{path} was left to pydicom"))
    found = read_slices(file)
    assert seen(found) == seen(expected)
    assert found[0].problem is None


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("syntax", PLAIN, ids=lambda syntax: syntax.name)
def test_of_a_thousand_damaged_files_none_is_read_otherwise_than_by_pydicom(tmp_path, syntax) -> None:
    # Little that does not matter, so that most of the damage hits what does.
    whole = written(
        tmp_path, syntax, plain_image(depth=2 * (syntax != ImplicitVRLittleEndian), private_bytes=40)
    ).read_bytes()
    file = tmp_path / "damaged"
    plain_files = 0
    for case in range(1000):
        write_anew(file, mutation(whole, 7, case))
        plain = plain_header(file)
        if plain is None:
            continue
        plain_files += 1
        try:
            found = seen(read_slices(file))
        except VolprepError as error:
            found = str(error)
        try:
            expected = seen(by_pydicom(file))
        except VolprepError as error:
            expected = str(error)
        assert found == expected, f"case {case}"
    assert plain_files > 250


@pytest.mark.parametrize("syntax", PLAIN, ids=lambda syntax: syntax.name)
def test_of_a_thousand_damaged_files_each_is_walked_as_by_the_slow_twin(tmp_path, syntax) -> None:
    depth = 2 * (syntax != ImplicitVRLittleEndian)
    whole = written(tmp_path, syntax, plain_image(depth=depth, private_bytes=40)).read_bytes()
    files = [tmp_path / str(case) for case in range(1000)]
    for case, file in enumerate(files):
        file.write_bytes(mutation(whole, 19, case))
    wanted = [*TAGS.values(), *PRIVATE_TAGS]
    found = _dicom.plain_headers([os.fsencode(file) for file in files], wanted, threads=3)
    assert found == [walked(file, wanted) for file in files]
    assert sum(header is not None for header in found) > 250
    assert _dicom.plain_headers([os.fsencode(file) for file in files], wanted, threads=1) == found


def test_what_slices_share_is_interpreted_once_and_never_differently(tmp_path) -> None:
    whole = written(tmp_path, data=plain_image(depth=0, private_bytes=40)).read_bytes()
    file = tmp_path / "damaged"
    sound = 0
    for case in range(500):
        write_anew(file, mutation(whole, 11, case))
        plain = plain_header(file)
        if plain is not None:
            header = (file, plain.elements, plain.transfer_syntax, plain.pixels)
            assert seen([slice_image(*header)]) == seen([interpreted(*header)]), f"case {case}"
            sound += interpreted(*header).problem is None
    assert sound > 25


SAMPLES = sorted(path for path in (Path(pydicom.data.__file__).parent / "test_files").glob("*.dcm"))


@pytest.mark.skipif(not SAMPLES, reason="pydicom came without its samples")
def test_the_samples_of_pydicom_are_read_as_pydicom_reads_them() -> None:
    plain = [path for path in SAMPLES if plain_header(path) is not None]
    assert len(plain) > 10
    for path in plain:
        assert _dicom.plain_headers([os.fsencode(path)], [*TAGS.values()], threads=1) == [walked(path, TAGS.values())]
        assert seen(read_slices(path)) == seen(by_pydicom(path)), path.name


UNUSUAL = {
    "big endian": lambda folder: written(folder, ExplicitVRBigEndian),
    "deflated": lambda folder: written(folder, DeflatedExplicitVRLittleEndian),
    "two frames": lambda folder: written(folder, data=plain_image(NumberOfFrames="2")),
    "frames in groups": lambda folder: written(
        folder, data=plain_image(PerFrameFunctionalGroupsSequence=Sequence([Dataset()]))
    ),
    "an implicit sequence without a length": lambda folder: written(folder, ImplicitVRLittleEndian),
    "sequences too deep": lambda folder: written(folder, data=plain_image(depth=12)),
}


@pytest.mark.parametrize("make", UNUSUAL.values(), ids=UNUSUAL)
def test_what_is_unusual_is_left_to_pydicom(tmp_path, make) -> None:
    assert plain_header(make(tmp_path)) is None


def changed(whole: bytes, old: bytes, new: bytes) -> bytes:
    assert whole.count(old) == 1
    return whole.replace(old, new)


ODD = {
    "no prefix": lambda whole: whole[132:],
    "elements out of order": lambda whole: changed(whole, b"\x28\0\x10\0US", b"\x28\0\x12\0US"),
    "an unknown type": lambda whole: changed(whole, b"\x28\0\x10\0US", b"\x28\0\x10\0XX"),
    "a length beyond the file": lambda whole: changed(whole, b"\x28\0\x30\0DS", b"\x28\0\x30\0OB"),
    "meta information that ends within an element": lambda whole: whole[:140] + b"\x07" + whole[141:],
    "a data set that is implicit though it says explicit": lambda whole: changed(
        whole, ExplicitVRLittleEndian.encode() + b"\0", b"1.2.840.10008.1.2\0\0\0"
    ),
    "another syntax": lambda whole: changed(whole, ExplicitVRLittleEndian.encode(), b"1.2.840.10008.1.2.9"),
    "no pixels": lambda whole: whole[: whole.index(b"\xe0\x7f\x10\0")],
}


@pytest.mark.parametrize("damage", ODD.values(), ids=ODD)
def test_what_is_odd_is_left_to_pydicom(tmp_path, damage) -> None:
    file = written(tmp_path)
    file.write_bytes(damage(file.read_bytes()))
    assert plain_header(file) is None


def test_a_header_longer_than_any_limit_is_left_to_pydicom(tmp_path) -> None:
    data = plain_image()
    data.add_new(0x00291011, "OB", bytes(2**25))
    file = written(tmp_path, data=data)
    assert plain_header(file) is None
    assert walked(file, TAGS.values()) is None


def test_wanted_values_longer_than_any_limit_are_left_to_pydicom(tmp_path) -> None:
    wanted = [*TAGS.values(), 0x00291010]
    for length, is_plain in ((2**20 - 4096, True), (2**20 + 2, False)):
        file = written(tmp_path, data=plain_image(private_bytes=length))
        (found,) = _dicom.plain_headers([os.fsencode(file)], wanted, threads=1)
        assert (found is not None) == is_plain
        assert found == walked(file, wanted)


def test_a_pipe_does_not_hold_the_walk_up(tmp_path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    code = "import sys; from volprep_formats import _dicom; print(_dicom.plain_headers([sys.argv[1].encode()], [], 1))"
    found = subprocess.run([sys.executable, "-c", code, pipe], timeout=20, check=True, capture_output=True, text=True)
    assert found.stdout == "[None]\n"


def test_what_cannot_be_read_is_not_plain(tmp_path) -> None:
    (tmp_path / "folder").mkdir()
    names = [b"missing", b"folder", b"with a zero\0", b"\xff\xfe"]
    found = _dicom.plain_headers([os.fsencode(tmp_path) + b"/" + name for name in names], [], threads=4)
    assert found == [None] * 4
    assert _dicom.plain_headers([], [], threads=4) == []


def test_the_tags_are_those_of_the_dictionary() -> None:
    assert {keyword: Tag(keyword) for keyword in TAGS} == TAGS
    assert pydicom.datadict.keyword_for_tag(TAGS["Rows"]) == "Rows"
