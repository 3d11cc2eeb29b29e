"""Results of drawing the textures that a profile allows, as `volprep doctor --json` prints them."""

from volprep_formats.package.api import Api
from volprep_formats.record import Record

Colour = tuple[float, float, float, float]
"""Red, green, blue and alpha, 0 to 1."""


class ProbeResult(Record):
    """Result of one capability."""

    api: Api
    """Version of OpenGL ES that drew it."""
    capability: str
    """Format, 2D or 3D, and the filter or the size."""
    size: int | None = None
    """Texels along an axis, if the size was tested."""
    works: bool
    """Whether the picture is right."""
    code: str | None = None
    """VP7060 for a wrong picture, VP7061 for a refusal by the driver; absent if it works."""
    words: str
    """Outcome."""
    remedy: str = ""
    """How to fix it; empty if it works."""
    expected: tuple[Colour, ...]
    """Expected colours of the pixels."""
    drawn: tuple[Colour, ...] = ()
    """Colours of the pixels as the driver has drawn them; empty if it has drawn nothing."""


class ProfileProbes(Record):
    """Results of everything that the packages of a profile may need."""

    profile: str
    """Name of the profile."""
    driver: str
    """Driver that has drawn."""
    milliseconds: float
    """Duration of all probes, including the context."""
    results: tuple[ProbeResult, ...]
    """One for each capability."""

    @property
    def wrong(self) -> tuple[ProbeResult, ...]:
        """Results that failed."""
        return tuple(result for result in self.results if not result.works)
