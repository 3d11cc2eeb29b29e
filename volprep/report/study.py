"""Measurements beyond the verdict: data and a page in the folder of the report."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from volprep.validation.subjects.scan import Judge
from volprep_formats.package.manifest import Manifest
from volprep_formats.progress import Progress
from volprep_formats.record import Record

Measure = Callable[[Manifest, Judge, Path, Progress, int | None], tuple[Record, str]]
"""Measure a package with a scan in an empty folder, with pictures of this size; return the data and their page."""


@dataclass(frozen=True)
class Study:
    """One study of a package."""

    name: str
    """Name of its files in the report."""
    title: str
    """Text of the link to its page."""
    measure: Measure
    """Measures a package."""
