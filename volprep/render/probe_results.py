"""What came of drawing what a profile allows, as `volprep doctor --json` prints it."""

from volprep_formats.package.profile import Api
from volprep_formats.record import Record

Colour = tuple[float, float, float, float]
"""Red, green, blue and alpha, 0 to 1."""


class ProbeResult(Record):
    """What came of one capability."""

    api: Api
    """Version of OpenGL ES with which it was drawn."""
    capability: str
    """Format, 2D or 3D, and the filter or the size."""
    size: int | None = None
    """Texels along an axis, if the size is what was tried."""
    works: bool
    """Whether the picture is right."""
    code: str | None = None
    """VP7060 for a wrong picture, VP7061 for what the driver refuses; absent if it works."""
    words: str
    """What happened."""
    remedy: str = ""
    """What to do; empty if it works."""
    expected: tuple[Colour, ...]
    """Colours of the pixels as they must be."""
    drawn: tuple[Colour, ...] = ()
    """Colours of the pixels as the driver has drawn them; none if it has not."""


class ProfileProbes(Record):
    """What came of all that the packages of a profile may need."""

    profile: str
    """Name of the profile."""
    driver: str
    """Driver that has drawn."""
    milliseconds: float
    """How long all took, with the context."""
    results: tuple[ProbeResult, ...]
    """One for each capability."""

    @property
    def wrong(self) -> tuple[ProbeResult, ...]:
        """What does not work."""
        return tuple(each for each in self.results if not each.works)
