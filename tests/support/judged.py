"""`validate` for tests of a verdict: every plot of the page is drawn, but none becomes SVG.

That takes matplotlib a second of processor time for each page, a third of the validation of a small package.
tests/report looks at the plots.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from volprep.report import validate as complete
from volprep.validation.results.report import Report
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress, Silent


def validate(
    package: Package | Path, report_path: Path | None = None, progress: Progress | None = None, **options: Any
) -> Report:
    """Validate a package as `volprep.report.validate` does; without a path the report lies beside it."""
    path = package.path if isinstance(package, Package) else package
    with patch("volprep.report.canvas._svg", _drawn):
        return complete.validate(path, report_path or path.with_suffix(".report"), progress or Silent(), **options)


def _drawn(draw: Callable[[Axes], None], *, legend_columns: int, **_size: object) -> str:
    # The narrow plot, with one column in its legend, is the wide one in other axes.
    if legend_columns > 1:
        draw(Figure().add_subplot())
    return '<svg aria-hidden="true"></svg>'
