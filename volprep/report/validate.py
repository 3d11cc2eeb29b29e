"""volprep validate: measure a package and write the report."""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from volprep.plan.device_files import read_devices
from volprep.report.page import page
from volprep.report.study import Study
from volprep.validation.folder import report_folder
from volprep.validation.results.report import Report
from volprep.validation.run import measure_package
from volprep.validation.subjects.scan import find_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.digest import manifest_sha256
from volprep_formats.progress import Progress


def validate(
    path: Path,
    report_path: Path,
    progress: Progress,
    *,
    source: Path | None = None,
    picture_size: int | None = None,
    witness: bool = False,
    devices: Path | None = None,
    studies: Sequence[Study] = (),
) -> Report:
    """Validate the sealed package at `path`, and write the report to the folder `report_path`.

    Parameters
    ----------
    path
        The package.
    report_path
        Folder of the report. An older report there is replaced when the new one is whole.
    source
        The scan, or a scene that names it; if absent, the origin beside the package names it.
    picture_size
        Width and height of the pictures, at least 16; if absent, as the scene says.
    witness
        Whether VTK also draws the scan, as a second opinion.
    devices
        Folder of measurements of this package on devices, for the report.
    studies
        Studies to also make: NAME.json and NAME.html in the folder `studies` of the report.

    Raises
    ------
    VolprepError
        VP4001 to VP4005, VP6010 if the package is not whole, VP6012 and VP6013 when the scan is unknown or another one,
        VP6020 and VP6021 when the report cannot be written, VP6040 and VP6041 when VTK cannot be used, VP7036 and
        VP7037 for a file that is not a measurement or is one of another package, and the errors of studies, reader and
        renderer. A package beyond the tolerance raises no error: the verdict reports it.
    """
    if report_path.resolve().is_relative_to(path.resolve()):
        raise VolprepError("VP6020", path=report_path, problem="it lies in the package, which never changes")
    measured = () if devices is None else read_devices(devices, manifest_sha256(path))
    with report_folder(report_path) as folder, _scratch(report_path) as scratch:
        report = measure_package(
            path, folder, scratch, progress, source=source, picture_size=picture_size, witness=witness
        )
        report = report.model_copy(update={"devices": measured})
        for study in studies:
            files = scratch / study.name
            files.mkdir()
            judge = find_scan(path, source)
            found = study.measure(report.package.manifest, judge, files, progress, picture_size)
            folder.write_study(study.name, *found)
        folder.write(report, page(report, studies))
    return report


@contextmanager
def _scratch(report_path: Path) -> Iterator[Path]:
    """Return an empty folder beside the report for the scan and its codes, which is removed in the end.

    A folder left by a killed validation is removed first. Only the owner may read it: it holds a scan.
    """
    target = report_path.resolve()
    folder = target.with_name(f".{target.name}.scratch")
    try:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(mode=0o700)
    except OSError as error:
        raise VolprepError("VP6021", path=folder, error=error.strerror or error) from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
