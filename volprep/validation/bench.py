"""Objects that all measurements of one validation share."""

from dataclasses import dataclass

from volprep.validation.folder import ReportFolder
from volprep.validation.subjects.subject import Subject
from volprep.validation.timing.clock import Clock
from volprep_formats.progress import Progress


@dataclass(frozen=True)
class Bench:
    """The subject of a validation, and where its results go."""

    subject: Subject
    """The package and its scan."""
    folder: ReportFolder
    """Takes the pictures."""
    clock: Clock
    """Records the time of each part."""
    progress: Progress
    """Progress callback."""
