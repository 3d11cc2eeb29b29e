"""Series are told apart as people do: by number, description, kernel, echo and time, and only on the screen."""

from pathlib import Path

import pytest
from dicom_files import save_all, stack

from volprep.batch.jobs import Defaults, Job
from volprep.batch.place import Place
from volprep.batch.run import find_jobs
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.dicom.listing import list_series
from volprep_formats.readers.dicom.naming import SeriesName, series_name
from volprep_formats.source import SourceSpec


def write(folder: Path, uid: str, number: int | None, count: int = 5, **attributes: object) -> Path:
    images = stack(count)
    for data in images:
        data.SeriesInstanceUID = uid
        if number is not None:
            data.SeriesNumber = number
        for keyword, value in attributes.items():
            setattr(data, keyword, value)
    save_all(images, folder)
    return folder


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Three series, two of which have one number."""
    soft = {"ConvolutionKernel": "B30f", "SeriesDescription": "JANE soft", "SeriesTime": "101112.5", "EchoTime": "4.6"}
    write(tmp_path / "in" / "a", "1.2.203", 7, **soft, ImageType=["ORIGINAL", "PRIMARY", "AXIAL"])
    write(tmp_path / "in" / "b", "1.2.5", 203, ConvolutionKernel="B70s")
    write(tmp_path / "in" / "c", "1.2.6", 7)
    return tmp_path / "in"


def opened(path: Path, series: str) -> int:
    with open_source(SourceSpec(path=str(path), series=series), Path("/"), Silent()) as source:
        return source.info.grid.shape_zyx[0]


def test_a_series_is_chosen_by_its_number_before_the_ending_of_its_uid(study: Path, tmp_path: Path) -> None:
    write(tmp_path / "other", "1.2.203", 7, 6)
    write(tmp_path / "other", "1.2.9", 203, 5)
    (tmp_path / "other" / "I005").unlink(missing_ok=True)
    assert opened(study, "203") == 5
    assert opened(study, "1.2.203") == 5


def test_two_series_of_one_number_are_named_with_their_uids(study: Path) -> None:
    with pytest.raises(VolprepError, match="2 series have the number 7") as caught:
        opened(study, "7")
    assert caught.value.code == "VP1302"
    assert "1.2.6" in caught.value.remedy


def test_a_series_is_told_with_number_kernel_echo_type_and_time(study: Path) -> None:
    name = series_name(study / "a" / "I000")
    assert name == SeriesName(7, "JANE soft", "B30f", 4.6, "AXIAL", "10:11:12")
    assert name.details == "B30f, echo 4.6 ms, AXIAL, 10:11:12"
    assert series_name(study / "c" / "I000").details == ""


def test_what_people_called_a_series_is_in_no_json(study: Path) -> None:
    listing = list_series(study, Silent(), described=True)
    assert {series.number for series in listing.series} == {7, 203}
    assert any("B30f" in series.details for series in listing.series)
    assert not any(word in listing.model_dump_json() for word in ("JANE", "B30f", "10:11"))


def test_a_file_without_a_header_does_not_keep_another_series_from_being_read(study: Path) -> None:
    (study / "notes.dcm").write_bytes(b"no header")
    assert opened(study, "203") == 5
    with pytest.raises(VolprepError, match="VP1031"), open_source(SourceSpec(path=str(study)), Path("/"), Silent()):
        pass


def batch(study: Path, pattern: str | None) -> list[Job]:
    return find_jobs(study, Place(study.parent / "out"), Defaults(names=pattern), Silent())


def test_a_batch_names_series_by_a_pattern_and_keeps_them_apart(study: Path) -> None:
    names = [job.name for job in batch(study, "s{series_number}_{kernel}")]
    assert sorted(name.rsplit("-", 1)[0] for name in names) == ["s203_b70s", "s7_b30f", "s7_x"]
    assert names == [job.name for job in batch(study, "s{series_number}_{kernel}")]
    with pytest.raises(VolprepError, match="VP8061"):
        batch(study, "{patient}")
