"""What `volprep validate --quick` tells: whether a package is whole and agrees with itself. Needs no OpenGL."""

from pathlib import Path
from typing import Self

from volprep_formats.diagnostics import VolprepError
from volprep_formats.record import Record


class Finding(Record):
    """One thing that is wrong with a package."""

    code: str
    """Permanent code from the catalogue of diagnostics."""
    summary: str
    """What is wrong."""
    remedy: str
    """What to do about it."""

    @classmethod
    def of(cls, error: VolprepError) -> Self:
        """Make the finding that says what `error` says."""
        return cls(code=error.code, summary=error.summary, remedy=error.remedy)


def check(path: Path) -> list[Finding]:
    """Check schema, names, sizes, SHA-256, what lies in the folder unnamed, and all cross references.

    Gives one finding for each thing that is wrong, none for a sound sealed package. Raises nothing.
    """
    raise NotImplementedError
