"""Names of a batch: explained to whoever ran it, and to nobody else; reasons of failures are in our own words."""

from pathlib import Path

import pytest
from batch_scans import write_scans
from command_line import volprep

from volprep.batch.explain import explain
from volprep.batch.place import Place
from volprep.batch.records import job_error
from volprep_formats.diagnostics import SafeText, VolprepError


@pytest.fixture
def place(tmp_path: Path) -> Place:
    """The folder of a batch that has noted two names, one of an empty file."""
    write_scans(tmp_path / "in", 1)
    (tmp_path / "in" / "JANE.nii").write_bytes(b"")
    place = Place(tmp_path / "out")
    place.prepare()
    sources = {"scan-1": str(tmp_path / "in" / "place-0" / "scan.nii"), "scan-2": str(tmp_path / "in" / "JANE.nii")}
    place.note_names(sources)
    place.note_names(sources)
    return place


def test_the_map_of_names_is_for_its_owner_alone_and_has_each_name_once(place: Place) -> None:
    (file,) = [path for path in (place.folder / ".batch").iterdir() if path.name == "names.jsonl"]
    assert file.stat().st_mode & 0o077 == 0
    assert len(file.read_text().splitlines()) == 2
    assert not [path for path in place.folder.iterdir() if "names" in path.name]


def test_a_name_is_explained_with_its_file_and_the_whole_reason(place: Place) -> None:
    lines = list(explain("scan-2", place))
    assert lines[0].endswith("JANE.nii")
    assert "the file is empty" in lines[-1]
    assert "can be opened" in list(explain("scan-1", place))[-1]
    with pytest.raises(VolprepError, match="VP8060"):
        list(explain("scan-3", place))


@pytest.mark.long
def test_the_command_line_explains_a_name(place: Place) -> None:
    ran = volprep("batch", "--explain", "scan-2", "-o", place.folder)
    assert "JANE.nii" in ran.stdout
    assert "Missing argument" in volprep("batch", "-o", place.folder).stderr


def test_reasons_in_our_own_words_stay_in_the_ledger_and_foreign_text_does_not() -> None:
    own = job_error(
        VolprepError("VP1002", path="JANE", problem=SafeText("the file is empty"), known=SafeText("nifti")), "scan-1"
    )
    assert own.summary == "scan-1: the file is empty"
    foreign = job_error(VolprepError("VP1002", path="JANE", problem="JANE", known="JANE"), "scan-1")
    assert "JANE" not in foreign.summary + foreign.remedy
