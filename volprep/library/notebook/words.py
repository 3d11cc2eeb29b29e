"""Describe a package in two sentences: its contents, and the verdict of its report."""

from volprep.report.text import number, size
from volprep.validation.folder import DATA_FILE, default_report_path
from volprep.validation.results.report import Report
from volprep.view.site import shown_with
from volprep_formats.package.reader import Package
from volprep_formats.shown import shown


def words_of(package: Package) -> str:
    """Return the contents of a package and the verdict of the report beside it.

    Raises the errors of `shown_with`.
    """
    manifest = package.manifest
    grid = manifest.box
    voxels = " × ".join(str(count) for count in grid.shape_zyx[::-1])
    spacing = " × ".join(number(each) for each in grid.spacing_mm_zyx[::-1])
    levels = f"{len(manifest.levels)} level{'s' if len(manifest.levels) > 1 else ''}"
    held = size(sum(file.size_bytes for file in manifest.files))
    profile = shown(manifest.profile.name)
    return f"{voxels} voxels of {spacing} mm, {levels}, {held}, profile {profile}. {_verdict(package)}"


def _verdict(package: Package) -> str:
    report = shown_with(package.path, None, default_report_path(package.path)).report
    if report is None:
        return "Not validated."
    data = Report.model_validate_json((report / DATA_FILE).read_bytes())
    verdict, limit = data.verdict, data.tolerance.rmse
    outcome = "passed" if verdict.passed else "failed"
    return f"Validation {outcome}: RMSE {number(verdict.worst_rmse)} in the worst view, {number(limit)} allowed."
