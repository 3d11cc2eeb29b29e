"""volprep study stress: measure the hard cases and write the report."""

from collections.abc import Sequence
from pathlib import Path

from volprep.lab.stress.cases import StressCase
from volprep.lab.stress.drawing import Trials
from volprep.lab.stress.measure import measure_stress
from volprep.lab.stress.records import StressReport
from volprep.report.environment import environment
from volprep.validation.folder import report_folder
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.progress import Progress


def stress_page(report: StressReport) -> str:
    """Write the page of `report` as HTML. The pictures that it shows lie beside it under the names in the report."""
    drawn = [result for result in report.results if result.drawings]
    template = environment(report.oracle_tolerance).get_template("stress.html.j2")
    return template.render(
        report=report,
        drawn=drawn,
        refused=[result for result in report.results if not result.drawings],
        faults=[(result.case, drawing) for result in drawn for drawing in result.drawings if not drawing.passed],
        failed=[result.case for result in report.results if not result.passed],
        ratios=[point.step_ratio for point in drawn[0].drawings[0].points] if drawn else [],
    )


def stress(
    cases: Sequence[StressCase],
    profile: DeviceProfile,
    report_path: Path,
    progress: Progress,
    trials: Trials = Trials(),  # noqa: B008 - it is frozen
) -> StressReport:
    """Build, draw and judge `cases` for a class of devices, and write the report to the folder `report_path`.

    Raises VP6017 for a profile without shaders, VP6020 and VP6021 when the report cannot be written, and the errors of
    the renderer.
    """
    if not profile.has_shaders:
        raise VolprepError("VP6017", profile=profile.name)
    with report_folder(report_path) as folder:
        report = measure_stress(cases, profile, folder, progress, trials)
        folder.write(report, stress_page(report))
    return report
