"""`validate` for tests of a verdict, with its report beside the package."""

from pathlib import Path
from typing import Any

from volprep.report import validate as complete
from volprep.validation.results.report import Report
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress, Silent


def validate(
    package: Package | Path, report_path: Path | None = None, progress: Progress | None = None, **options: Any
) -> Report:
    """Validate a package as `volprep.report.validate` does; without a path the report lies beside it."""
    path = package.path if isinstance(package, Package) else package
    return complete.validate(path, report_path or path.with_suffix(".report"), progress or Silent(), **options)
