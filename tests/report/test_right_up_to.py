"""The size of pictures that coarse levels are right up to, from the report beside a package."""

from pathlib import Path

import pytest
from sample_report import level_drawing, seen

from volprep.validation.folder import default_report_path, report_folder
from volprep.validation.results.report import Report
from volprep.validation.verdicts.sizes import right_up_to_pixels
from volprep_cli.inspect_tables import tables_of
from volprep_formats.package.digest import manifest_sha256


@pytest.fixture
def package(tmp_path, report) -> Path:
    folder = tmp_path / "head.volpkg"
    folder.mkdir()
    (folder / "manifest.json").write_text(report.package.manifest.model_dump_json())
    return folder


def write_report(package: Path, report: Report, *levels: tuple[int, bool]) -> None:
    """Write a report with levels that are right up to 48 pixels, or for no size."""
    others = tuple(level_drawing(level, seen(0.02), passed=passed) for level, passed in levels)
    (program,) = report.programs
    changed = {
        "programs": (program.model_copy(update={"others": others}),),
        "package": report.package.model_copy(update={"manifest_sha256": manifest_sha256(package)}),
    }
    with report_folder(default_report_path(package)) as folder:
        folder.write(report.model_copy(update=changed), "page")


def test_the_worst_drawing_of_a_level_counts(package, report) -> None:
    write_report(package, report, (1, True), (1, True), (2, True), (2, False), (3, False), (3, True))
    assert right_up_to_pixels(package) == {1: 48, 2: None, 3: None}


def test_nothing_is_known_without_a_report_of_this_package(package, report) -> None:
    assert right_up_to_pixels(package) == {}
    write_report(package, report, (1, True))
    manifest = package / "manifest.json"
    manifest.write_text(manifest.read_text() + " ")
    assert right_up_to_pixels(package) == {}


def test_inspect_prints_the_size_beside_each_level_that_has_one(report) -> None:
    manifest = report.package.manifest
    levels = {level.index for level in manifest.levels}
    assert levels == {0, 1}

    def printed(right: dict[int, int | None]) -> list[tuple[str, ...]]:
        return next([table.headings, *table.rows] for table in tables_of(manifest, right) if table.title == "LEVELS")

    assert [row[-1] for row in printed({1: 48})] == ["right up to", "–", "48 pixels"]
    assert [row[-1] for row in printed({1: None})] == ["right up to", "–", "no size"]
    assert next(iter(printed({})))[-1] == "use"
