"""Studies of one package: the curves of its choices, and the value of its items."""

from pathlib import Path

from volprep.lab.ablation.measure import measure_ablation
from volprep.lab.ablation.page import ablation_page
from volprep.lab.ablation.records import Ablation
from volprep.lab.curves.measure import measure_curves
from volprep.lab.curves.page import curves_page
from volprep.lab.curves.records import CurvesReport
from volprep.report.study import Study
from volprep.validation.scan import Judge
from volprep_formats.package.manifest import Manifest
from volprep_formats.progress import Progress


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
