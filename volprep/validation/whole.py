"""Whether a package is whole and agrees with itself: what can be told without OpenGL and without the scan."""

from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package


def open_whole(path: Path) -> Package:
    """Open the sealed package at `path` after checking it.

    Raises VP4001 to VP4005 where there is no sealed package that can be read, VP6010 with all that is wrong.
    """
    package = Package.open_any(path)
    findings = check(path)
    if findings:
        listed = "; ".join(f"{finding.code} {finding.summary}" for finding in findings)
        raise VolprepError("VP6010", path=path, findings=listed, remedy=findings[0].remedy)
    return package
