"""stress.json: how the chain from scan to picture bears cases in which arithmetic is hard; and its page."""

from typing import Annotated, Literal

from pydantic import Field

from volprep.validation.records import Driver, ErrorNumbers, NonNegative, Target
from volprep.validation.verdict import passes
from volprep_formats.grid import Count
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.program import ClassificationName, TechniqueName
from volprep_formats.record import Record

Precision = Literal["highp", "mediump", "mediump-coordinates"]
"""Numbers of a shader: as it ships, or rounded as a phone may."""


class StressPoint(Record):
    """One distance of the samples, in the oblique view."""

    step_ratio: Annotated[float, Field(gt=0.0)]
    """Distance over the nominal one."""
    rmse: NonNegative
    """Root mean square error against truth."""
    draw_ms: NonNegative
    """Median time of a draw, in milliseconds."""


class StressDrawing(Record):
    """One case, drawn in one way."""

    classification: ClassificationName
    """What becomes a colour: each sample, or each segment between two."""
    technique: TechniqueName = "ray-casting"
    """How the program goes through the volume."""
    level: Annotated[int, Field(ge=0)] = 0
    """Level that is drawn. A coarse one is compared with an integral of what it holds."""
    precision: Precision = "highp"
    """Numbers of the shader. highp: as it ships. mediump: each operation is rounded to a 16-bit float.
    mediump-coordinates: only the coordinates of textures are."""
    total: ErrorNumbers
    """The worst view against truth: the one with the largest share of the limit, or of the usual tolerance."""
    precise: ErrorNumbers | None = None
    """The same in a target of floats, where a program blends layers, each of which 8 bits round: this is judged."""
    limit: Tolerance | None
    """Largest error that it may have; null where it is only reported."""
    laws: tuple[str, ...]
    """Laws of light that a picture breaks, in words."""
    points: tuple[StressPoint, ...]
    """Error against run time, coarsest step first; of ray casting, and of layers in a target of 8 bits."""
    picture: str | None
    """File of the oblique view over black, side by side: truth, rendering, difference; null where there is none."""

    @property
    def passed(self) -> bool:
        """Whether the error is within the limit, and no law is broken."""
        return not self.laws and (self.limit is None or passes(self.precise or self.total, self.limit))

    @property
    def is_first(self) -> bool:
        """Whether it is how scenes are drawn that ask for nothing: the others vary it in one thing."""
        return (self.technique, self.level, self.precision) == ("ray-casting", 0, "highp")

    @property
    def name(self) -> str:
        """What draws, in words."""
        varied = (
            self.technique if self.technique != "ray-casting" else None,
            f"level {self.level}" if self.level else None,
            self.precision if self.precision != "highp" else None,
        )
        return ", ".join((self.classification, *(each for each in varied if each)))


class StressResult(Record):
    """One case."""

    case: str
    """Its name."""
    hard: str
    """What makes it hard."""
    refused: str | None
    """Code of the error with which it was refused; null where it was drawn."""
    must_refuse: str | None
    """Code of the error with which it must be refused; null where it must be drawn."""
    drawings: tuple[StressDrawing, ...]
    """Ways in which it was drawn; none where it was refused."""

    @property
    def passed(self) -> bool:
        """Whether it was refused or drawn as it must be."""
        return self.refused == self.must_refuse and all(drawing.passed for drawing in self.drawings)


class StressReport(Record):
    """All cases on one class of devices."""

    format: Literal["volprep-stress"] = "volprep-stress"
    """Marks the file."""
    version: Literal["1.0"] = "1.0"
    """Version of the format: major.minor."""
    generator: str
    """Program and version that drew."""
    profile: str
    """Class of devices."""
    picture_size: Count
    """Width and height of the pictures, in pixels."""
    oracle_tolerance: NonNegative
    """Bound that the oracle was asked to keep for each channel."""
    laws_target: Target
    """Target of the pictures that laws were checked in; errors are those of 8 bits."""
    difference_gain: Annotated[float, Field(gt=0.0)]
    """Factor on the differences in the pictures."""
    passed: bool
    """Whether every case is refused or drawn as it must be."""
    results: tuple[StressResult, ...]
    """Cases."""
    left_out: tuple[str, ...] = ()
    """Cases that were not tried, because the time was over."""
    driver: Driver | None
    """The OpenGL ES that drew; null where every case was refused."""
