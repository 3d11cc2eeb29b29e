"""The folder of a report appears whole, or not at all."""

import json
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest

from volprep.validation.folder import DATA_FILE, PAGE_FILE, PICTURES, report_folder
from volprep.validation.results.report import Report
from volprep_formats.diagnostics import VolprepError

PICTURE = np.arange(16 * 17 * 3, dtype=np.uint8).reshape(16, 17, 3)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def write(target: Path, report: Report) -> None:
    with report_folder(target) as folder:
        folder.picture(f"{PICTURES}/a.png", PICTURE)
        folder.write(report, report.verdict.worst_view)


def test_it_holds_data_page_and_pictures(tmp_path, report) -> None:
    write(tmp_path / "report", report)
    assert (tmp_path / "report" / PAGE_FILE).read_text(encoding="utf-8") == report.verdict.worst_view
    assert set(contents(tmp_path / "report")) == {DATA_FILE, PAGE_FILE, "pictures/a.png"}
    assert Report.model_validate_json((tmp_path / "report" / DATA_FILE).read_bytes()) == report
    read = OpenImageIO.ImageBuf(str(tmp_path / "report" / PICTURES / "a.png")).get_pixels("uint8")
    np.testing.assert_array_equal(read, PICTURE)


def test_the_same_report_gives_the_same_files(tmp_path, report) -> None:
    write(tmp_path / "one", report)
    write(tmp_path / "two", report)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


def test_nothing_is_there_before_it_is_whole(tmp_path, report) -> None:
    target = tmp_path / "report"
    with report_folder(target) as folder:
        folder.picture(f"{PICTURES}/a.png", PICTURE)
        assert not target.exists()
        folder.write(report, report.verdict.worst_view)
        assert not target.exists()
    assert target.is_dir()


def test_a_failure_leaves_the_older_report_and_nothing_beside_it(tmp_path, report) -> None:
    target = tmp_path / "report"
    write(target, report)
    before = contents(target)

    def fail() -> None:
        with report_folder(target) as folder:
            folder.picture(f"{PICTURES}/b.png", PICTURE)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert contents(target) == before
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_an_older_report_gives_way_with_all_its_pictures(tmp_path, report) -> None:
    target = tmp_path / "report"
    write(target, report)
    (target / PICTURES / "old.png").write_bytes(b"old")
    write(target, report)
    assert set(contents(target)) == {DATA_FILE, PAGE_FILE, "pictures/a.png"}
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_what_a_killed_run_left_does_not_stay(tmp_path, report) -> None:
    for left in (".report.partial", ".report.older"):
        (tmp_path / left / PICTURES).mkdir(parents=True)
        (tmp_path / left / PICTURES / "stale.png").write_bytes(b"")
    write(tmp_path / "report", report)
    assert [path.name for path in tmp_path.iterdir()] == ["report"]
    assert "pictures/stale.png" not in contents(tmp_path / "report")


@pytest.mark.parametrize("foreign", ["thesis.txt", "photos/cat.jpg"])
def test_a_folder_with_other_files_is_not_replaced(tmp_path, report, foreign) -> None:
    target = tmp_path / "report"
    write(target, report)
    (target / foreign).parent.mkdir(exist_ok=True)
    (target / foreign).write_text("mine")
    with pytest.raises(VolprepError, match="VP6020") as caught:
        write(target, report)
    assert foreign.split("/")[0] in caught.value.summary
    assert (target / foreign).read_text() == "mine"


def test_a_file_in_its_place_is_not_replaced(tmp_path, report) -> None:
    (tmp_path / "report").write_text("mine")
    with pytest.raises(VolprepError, match="VP6020"):
        write(tmp_path / "report", report)
    assert (tmp_path / "report").read_text() == "mine"


def test_an_empty_folder_is_taken(tmp_path, report) -> None:
    (tmp_path / "report").mkdir()
    write(tmp_path / "report", report)
    assert (tmp_path / "report" / PAGE_FILE).is_file()


def test_a_place_that_cannot_be_written_is_one_message(tmp_path, report) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(VolprepError, match="VP6021"):
        write(tmp_path / "file" / "report", report)


def test_the_data_names_its_format(tmp_path, report) -> None:
    write(tmp_path / "report", report)
    data = json.loads((tmp_path / "report" / DATA_FILE).read_text())
    assert (data["format"], data["version"]) == ("volprep-report", "1.0")
