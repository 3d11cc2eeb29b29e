"""The quick walk over DICOM headers gives what pydicom gives, or leaves the file to it: also for damaged files."""

from pathlib import Path

import numpy as np
import pytest
from dicom_files import compressed, image, save
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    RLELossless,
)

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers import dicom_file
from volprep_formats.readers.dicom_walk import walk_header

QUICK = [ExplicitVRLittleEndian, ImplicitVRLittleEndian, RLELossless]


def example(folder: Path, syntax: str, **attributes) -> Path:
    data = image(np.arange(80, dtype=np.int16).reshape(8, 10), (1, 2, 3), ImageType=["ORIGINAL", "M"], **attributes)
    data.PatientName = "Somebody"
    data.add_new((0x0019, 0x0010), "LO", "SIEMENS MR HEADER")
    data.add_new((0x0019, 0x100A), "US", 7)
    if syntax == RLELossless:
        compressed(data, syntax)
    return save(data, folder / "slice", syntax)


def outcome(file: Path) -> str:
    """All that a reader gets from a file, errors included."""
    with dicom_file.quiet_pydicom():
        try:
            return repr(dicom_file.read_slices(file))
        except VolprepError as error:
            return str(error)


def by_pydicom(file: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    with monkeypatch.context() as patch:
        patch.setattr(dicom_file, "walk_header", lambda _head: None)
        return outcome(file)


@pytest.mark.parametrize("syntax", QUICK)
def test_ordinary_files_are_walked_over_with_the_same_result(tmp_path, monkeypatch, syntax) -> None:
    file = example(tmp_path, syntax)
    assert walk_header(file.read_bytes()) is not None
    assert "SliceImage(" in outcome(file)
    assert outcome(file) == by_pydicom(file, monkeypatch)


@pytest.mark.parametrize("syntax", [ExplicitVRBigEndian, DeflatedExplicitVRLittleEndian])
def test_other_syntaxes_are_left_to_pydicom(tmp_path, syntax) -> None:
    assert walk_header(example(tmp_path, syntax).read_bytes()) is None


def test_a_sequence_of_defined_length_is_stepped_over(tmp_path) -> None:
    file = example(tmp_path, ExplicitVRLittleEndian, ReferencedImageSequence=Sequence([Dataset()]))
    assert walk_header(file.read_bytes()) is not None


def test_a_sequence_of_undefined_length_is_left_to_pydicom(tmp_path) -> None:
    data = image(np.zeros((2, 3), np.int16), ReferencedImageSequence=Sequence([Dataset()]))
    data["ReferencedImageSequence"].is_undefined_length = True
    assert walk_header(save(data, tmp_path / "slice").read_bytes()) is None


def test_functional_groups_are_left_to_pydicom(tmp_path) -> None:
    file = example(tmp_path, ExplicitVRLittleEndian, PerFrameFunctionalGroupsSequence=Sequence([]))
    assert walk_header(file.read_bytes()) is None


@pytest.mark.parametrize("syntax", QUICK)
def test_every_prefix_and_many_mutations_have_the_same_result(tmp_path, monkeypatch, syntax) -> None:
    file = example(tmp_path, syntax)
    whole = np.frombuffer(file.read_bytes(), np.uint8)
    cases = [whole[:size] for size in range(100, len(whole), 11)]
    chance = np.random.default_rng(13)
    for _ in range(300):
        mutated = whole.copy()
        at = chance.integers(128, len(whole) - 100, chance.integers(1, 5))
        mutated[at] = chance.choice([chance.integers(0, 256), 0, 255, 2, 65], len(at))
        cases.append(mutated)
    quick = 0
    for case in cases:
        file.write_bytes(case.tobytes())
        with dicom_file.quiet_pydicom():
            quick += walk_header(case.tobytes()) is not None
        assert outcome(file) == by_pydicom(file, monkeypatch)
    assert quick > 60
