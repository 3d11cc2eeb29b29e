"""`make levels-study`: measures what coarse levels keep, and writes a page with pictures to out/levels-study.

A run that was ended goes on when it is called again; with --again it begins anew, as it must after a change of levels.
"""

import argparse
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.levels_study.measure import StudyPicture, StudyRow
from tests.levels_study.page import sentences, write_study
from tests.levels_study.promise import PromiseRow
from tests.levels_study.results import Settings, results
from tests.levels_study.subjects import Subject, phantom_subjects, scan_subjects

_FOUND = "found"
"""Folder of the results of subjects, below that of the page."""


def main() -> None:
    """Measure the subjects that are asked for; all phantoms and scans if none are."""
    parser = argparse.ArgumentParser(prog="make levels-study", description=__doc__)
    parser.add_argument("--only", nargs="*", default=[], metavar="TEXT", help="subjects whose names hold one of these")
    parser.add_argument("--size", type=int, default=64, help="voxels along an edge of phantoms")
    parser.add_argument("--pixels", type=int, default=64, help="pixels along an edge of pictures")
    parser.add_argument("--levels", type=int, nargs="*", default=[1, 2, 3], help="levels")
    parser.add_argument("--thorough", action="store_true", help='also refine = "thorough"')
    parser.add_argument("--phantoms", action="store_true", help="phantoms only")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/levels-study"), help="folder of the page")
    parser.add_argument("--processes", type=int, default=1, help="subjects that are measured at the same time")
    parser.add_argument("--again", action="store_true", help="begin anew, though an earlier run was ended")
    asked = parser.parse_args()
    if asked.again:
        shutil.rmtree(asked.output / _FOUND, ignore_errors=True)
    settings = Settings(asked.pixels, tuple(asked.levels), asked.thorough)
    console = Console()
    rows: list[StudyRow] = []
    pictures: list[StudyPicture] = []
    steps: list[PromiseRow] = []

    def is_wanted(name: str) -> bool:
        return not asked.only or any(text in name for text in asked.only)

    subjects = (each for each in _subjects(asked.size, is_wanted, phantoms_only=asked.phantoms) if is_wanted(each.name))
    for found in results(subjects, settings, asked.output / _FOUND, asked.processes):
        rows += found.rows
        pictures += found.pictures
        steps += found.steps
        console.print(_table([row for row in found.rows if row.level]))
        for promise in found.steps:
            kept = "kept" if promise.rmse <= promise.limit else "missed"
            numbers = f"{promise.step_voxels:.3g} voxels, {promise.rmse:.4f} of {promise.limit:.4f} promised"
            console.print(f"step of level {promise.level}: {numbers}, {kept}")
        # Written after each subject, so that a study that is stopped leaves what it has found.
        write_study(rows, pictures, steps, asked.output)
    for sentence in sentences(rows):
        console.print(sentence)
    console.print(f"{asked.output / 'index.html'}")


def _subjects(size: int, is_wanted: Callable[[str], bool], *, phantoms_only: bool) -> Iterator[Subject]:
    yield from phantom_subjects(size)
    data = os.environ.get("VOLPREP_TEST_DATA")
    if data and not phantoms_only:
        yield from scan_subjects(Path(data), is_wanted)


def _table(rows: list[StudyRow]) -> Table:
    table = Table("way", "level", "filter", "RMSE, seen", "kept light", "least", "kB", "s", title=rows[0].subject)
    for row in rows:
        numbers = (f"{row.seen_rmse:.4f}", f"{row.kept_light:.2f}", f"{row.least_kept:.2f}")
        table.add_row(
            row.way, str(row.level), row.chosen, *numbers, f"{row.size_bytes / 1e3:.0f}", f"{row.seconds:.2f}"
        )
    return table


if __name__ == "__main__":
    main()
