"""volprep study stress: measure the hard cases and write the report."""

from collections.abc import Sequence
from pathlib import Path

from volprep.lab.stress.cases import StressCase
from volprep.lab.stress.drawing import Trials
from volprep.lab.stress.measure import measure_stress
from volprep.lab.stress.page import stress_page
from volprep.lab.stress.records import StressReport
from volprep.validation.folder import report_folder
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.progress import Progress


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
