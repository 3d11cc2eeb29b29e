"""Check that a package is whole and consistent, as far as possible without OpenGL and without the scan."""

from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package


def open_whole(path: Path) -> Package:
    """Open the sealed package at `path` after checking it.

    Raises VP4001 to VP4005 if there is no readable sealed package, VP6010 with all of its faults.
    """
    package = Package.open_any(path)
    findings = check(path)
    if findings:
        listed = "; ".join(f"{finding.code} {finding.summary}" for finding in findings)
        raise VolprepError("VP6010", path=path, findings=listed, remedy=findings[0].remedy)
    return package
