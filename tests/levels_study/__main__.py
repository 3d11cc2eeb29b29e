"""`make levels-study`: measures what coarse levels keep, and writes a page with pictures to out/levels-study."""

import argparse
import os
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.levels_study.measure import StudyPicture, StudyRow, measure
from tests.levels_study.page import sentences, write_study
from tests.levels_study.promise import PromiseRow, promises
from tests.levels_study.subjects import Subject, phantom_subjects, scan_subjects


def main() -> None:
    """Measure the subjects that are asked for; all phantoms and scans if none are."""
    parser = argparse.ArgumentParser(prog="make levels-study", description=__doc__)
    parser.add_argument("--only", nargs="*", default=[], metavar="TEXT", help="subjects whose names hold one of these")
    parser.add_argument("--size", type=int, default=96, help="voxels along an edge of phantoms")
    parser.add_argument("--pixels", type=int, default=128, help="pixels along an edge of pictures")
    parser.add_argument("--levels", type=int, nargs="*", default=[1, 2, 3], help="levels")
    parser.add_argument("--thorough", action="store_true", help='also refine = "thorough"')
    parser.add_argument("--phantoms", action="store_true", help="phantoms only")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/levels-study"), help="folder of the page")
    asked = parser.parse_args()
    console = Console()
    rows: list[StudyRow] = []
    pictures: list[StudyPicture] = []
    steps: list[PromiseRow] = []

    def is_wanted(name: str) -> bool:
        return not asked.only or any(text in name for text in asked.only)

    for subject in _subjects(asked.size, is_wanted, phantoms_only=asked.phantoms):
        if not is_wanted(subject.name):
            continue
        found = list(measure(subject, asked.levels, asked.pixels, thorough=asked.thorough))
        rows += [row for row, _ in found]
        pictures += [picture for _, picture in found]
        console.print(_table([row for row, _ in found if row.level]))
        for promise in promises(subject, asked.pixels):
            steps.append(promise)
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
