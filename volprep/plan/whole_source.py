"""A source that has been imported, for decisions that are measured on all of it."""

from dataclasses import dataclass, field

from volprep.plan.form_trial import FormTrial
from volprep.scan.slabs import RawVolume
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo


@dataclass(frozen=True)
class WholeSource:
    """A source as the working data of a draft."""

    volume: RawVolume
    """Stored values."""
    info: SourceInfo
    """Description of the source."""
    sha256: str
    """Digest of the source."""
    progress: Progress
    """Progress callback."""
    known: list[FormTrial] = field(default_factory=list)
    """Earlier results; new ones are added."""
