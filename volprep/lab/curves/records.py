"""Frozen records of curves.json: the cost and the error of each choice. The page shows nothing else."""

from typing import Annotated, Literal

from pydantic import Field

from volprep.validation.results.measurements import Driver
from volprep.validation.results.seen import NonNegative
from volprep.validation.timing.turns import Milliseconds
from volprep_formats.grid import Count
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.values import ByteCount
from volprep_formats.record import Record

Cost = Literal["milliseconds", "bytes", "seconds"]
"""Cost of a choice: time to draw a picture, bytes that a device uploads, or time to build."""

COST_NAMES: dict[Cost, str] = {
    "milliseconds": "median milliseconds per draw",
    "bytes": "megabytes to upload",
    "seconds": "seconds to build",
}
"""Costs in the units in which people read them."""


class CurveErrors(Record):
    """Errors of a picture against the truth."""

    rmse: NonNegative
    """Root mean square over seen pixels and the four channels, premultiplied linear."""
    maximum: NonNegative
    """Largest difference of one channel of one pixel, premultiplied linear."""
    ssim_black: float
    """Structural similarity over black, sRGB, on the foreground."""
    ssim_white: float
    """Structural similarity over white, sRGB, on the foreground."""
    flip_black: NonNegative
    """FLIP over black, mean of seen pixels, at 67 pixels a degree."""
    flip_white: NonNegative
    """FLIP over white, mean of seen pixels, at 67 pixels a degree."""


class CurvePoint(Record):
    """One variant, drawn and compared."""

    label: str
    """Description of the variant."""
    series: str
    """Points of one series belong together: they differ in the step alone."""
    level: Annotated[int, Field(ge=0)]
    """Level that was drawn."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Distance of the samples."""
    errors: CurveErrors
    """Against the oracle on the scan."""
    wall: Milliseconds
    """Time of a picture: by the clock on the wall, or of the processor if the driver draws with it."""
    gpu: Milliseconds | None
    """Time of a picture by the driver's own clock; null if it has none."""
    upload_bytes: ByteCount
    """Texture and mesh files that a device uploads for this picture."""
    package_bytes: ByteCount
    """The whole package."""
    build_seconds: NonNegative
    """Time of the build of the package, without its draws."""
    chosen: bool
    """Whether the package on trial has this."""
    on_front: bool
    """Whether no other variant is clearly better in cost or in error, and in neither clearly worse."""


class Refusal(Record):
    """A variant that cannot be, for this scan and this class of devices."""

    label: str
    """Value that was wanted."""
    problem: str
    """Reason why it cannot be built, with the code of the diagnostic if there is one."""


class Curve(Record):
    """One choice, and all its variants."""

    name: str
    """Description of the choice."""
    question: str
    """Question that the curve answers."""
    cost: Cost
    """Cost in which the variants differ, besides the error."""
    points: tuple[CurvePoint, ...]
    """Variants that were drawn."""
    refused: tuple[Refusal, ...] = ()
    """Variants that cannot be built."""
    reason: str | None
    """Reason for the value of the package under test, in the words of its plan; null if the plan gives none."""
    left_out: str | None = None
    """Reason why nothing was measured; null if something was."""


STOPPED = "the run was stopped before"
"""Reason of a choice that a stopped run has not measured."""


class CurvesReport(Record):
    """All curves of one package."""

    generator: str
    """Program and version that measured."""
    package: str
    """Name of the package on trial."""
    profile: str
    """Class of devices."""
    transfer: str
    """Transfer function that was drawn."""
    view: str
    """View that was drawn."""
    picture_size: Count
    """Width and height of the pictures."""
    reduced_by: Count
    """Voxels of the scan, along each axis, that were averaged for the measurement; 1: the scan itself."""
    shape_zyx: tuple[Count, Count, Count]
    """Voxels of the measured scan."""
    tolerance: Tolerance
    """Tolerance of the scene."""
    driver: Driver
    """The OpenGL ES that drew."""
    seconds: NonNegative
    """Duration of the measurement."""
    curves: tuple[Curve, ...]
    """One for each choice."""

    @property
    def is_stopped(self) -> bool:
        """Whether the run was stopped before all choices were measured."""
        return any(curve.left_out == STOPPED for curve in self.curves)


def plotted_cost(point: CurvePoint, cost: Cost) -> float:
    """Return the cost of a variant, in the unit of its name."""
    costs = {"milliseconds": point.wall.median, "bytes": point.upload_bytes / 1e6, "seconds": point.build_seconds}
    return costs[cost]
