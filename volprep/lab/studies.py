"""Studies of one package: the curves of its choices, and the value of its items."""

from pathlib import Path
from tempfile import TemporaryDirectory

from volprep.lab.ablation.measure import measure_ablation
from volprep.lab.ablation.page import ablation_page
from volprep.lab.ablation.records import Ablation
from volprep.lab.curves.measure import measure_curves
from volprep.lab.curves.page import curves_page
from volprep.lab.curves.records import CurvesReport
from volprep.report.study import Study
from volprep.validation.subjects.scan import Judge, find_scan
from volprep_formats.output import new_folder
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _curves(
    manifest: Manifest, judge: Judge, folder: Path, progress: Progress, picture_size: int | None
) -> tuple[CurvesReport, str]:
    found = measure_curves(manifest, judge, folder, progress, picture_size)
    return found, curves_page(found)


def _ablation(
    manifest: Manifest, judge: Judge, folder: Path, progress: Progress, picture_size: int | None
) -> tuple[Ablation, str]:
    found = measure_ablation(manifest, judge, folder, progress, picture_size)
    return found, ablation_page(found)


CURVES = Study("curves", "Curves of all choices", _curves)
ABLATION = Study("ablation", "Leaving out", _ablation)
STUDIES = {study.name: study for study in (CURVES, ABLATION)}
"""Studies of a package, by name."""


def write_study(  # noqa: PLR0917 - the study, its input, its output, and how
    study: Study,
    package: Path,
    folder: Path,
    progress: Progress,
    source: Path | None = None,
    picture_size: int | None = None,
) -> Record:
    """Make a study of a sealed package, write NAME.json and NAME.html to the new folder `folder`, and return its data.

    `source` and `picture_size` are as for `validate`. Raises VP6021 if the folder cannot be written, and the errors of
    `find_scan` and of the study.
    """
    judge = find_scan(package, source)
    with new_folder(folder, "VP6021") as place:
        with TemporaryDirectory(dir=place) as scratch:
            data, page = study.measure(Package.open(package).manifest, judge, Path(scratch), progress, picture_size)
        (place / f"{study.name}.json").write_text(data.model_dump_json(indent=2) + "\n", encoding="utf-8")
        (place / f"{study.name}.html").write_text(page, encoding="utf-8")
    return data
