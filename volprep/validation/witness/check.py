"""Records of the comparisons that independent readers make."""

from typing import Annotated

from pydantic import Field

from volprep_formats.record import Record

NonNegative = Annotated[float, Field(ge=0.0)]


class WitnessCheck(Record):
    """One comparison: something that product and truth share, with the result of an independent reader or of NumPy."""

    item: str
    """Name of the compared thing."""
    by: str
    """Library that read or computed it independently, with its version."""
    what: str
    """Meaning and unit of `found`."""
    found: NonNegative
    """The difference."""
    limit: NonNegative
    """Largest difference that still counts as agreement."""

    @property
    def passed(self) -> bool:
        """Whether both agree."""
        return self.found <= self.limit
