"""curves.json: what each choice costs and how wrong it is, as frozen records. The page shows nothing else."""

from typing import Annotated, Literal

from pydantic import Field

from volprep.validation.records import Driver, NonNegative
from volprep_formats.grid import Count
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.values import ByteCount
from volprep_formats.record import Record

Cost = Literal["milliseconds", "bytes", "seconds"]
"""What a choice costs: time to draw a picture, bytes that a device uploads, or time to build."""

COST_NAMES: dict[Cost, str] = {
    "milliseconds": "median milliseconds per draw",
    "bytes": "megabytes to upload",
    "seconds": "seconds to build",
}
"""Costs in the units in which people read them."""


class CurveErrors(Record):
    """How far a picture is from the truth."""

    rmse: NonNegative
    """Root mean square over all pixels and the four channels, premultiplied linear."""
    maximum: NonNegative
    """Largest difference of one channel of one pixel, premultiplied linear."""
    ssim_black: float
    """Structural similarity over black, sRGB, on the foreground."""
    ssim_white: float
    """Structural similarity over white, sRGB, on the foreground."""
    flip_black: NonNegative
    """FLIP over black, mean of the foreground, at 67 pixels a degree."""
    flip_white: NonNegative
    """FLIP over white, mean of the foreground, at 67 pixels a degree."""


class Milliseconds(Record):
    """Several times for the same picture."""

    median: NonNegative
    """Median."""
    low: NonNegative
    """First quartile."""
    high: NonNegative
    """Third quartile."""
    pictures: Count
    """How many were drawn."""


class CurvePoint(Record):
    """One variant, drawn and compared."""

    label: str
    """What it is."""
    series: str
    """Points of one series belong together: they differ in the step alone."""
    level: Annotated[int, Field(ge=0)]
    """Level that was drawn."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Distance of the samples."""
    errors: CurveErrors
    """Against the oracle on the scan."""
    wall: Milliseconds
    """Time of a picture by the clock on the wall."""
    gpu: Milliseconds | None
    """Time of a picture by the driver's own clock; null where it has none."""
    upload_bytes: ByteCount
    """Texture and mesh files that a device uploads for this picture."""
    package_bytes: ByteCount
    """The whole package."""
    build_seconds: NonNegative
    """Time of the build of the package, without its draws."""
    chosen: bool
    """Whether the package on trial has this."""
    on_front: bool
    """Whether no other variant costs less or as much, and is as near to the truth or nearer."""


class Refusal(Record):
    """A variant that cannot be, for this scan and this class of devices."""

    label: str
    """What was wanted."""
    problem: str
    """Why not, with the code of the diagnostic if there is one."""


class Curve(Record):
    """One choice, and all its variants."""

    name: str
    """What is chosen."""
    question: str
    """What the curve answers."""
    cost: Cost
    """What the variants differ in, besides the error."""
    points: tuple[CurvePoint, ...]
    """Variants that were drawn."""
    refused: tuple[Refusal, ...] = ()
    """Variants that cannot be."""
    reason: str | None
    """Why the package on trial has what it has, in the words of its plan; null where the plan does not say."""
    left_out: str | None = None
    """Why nothing was measured; null where something was."""


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
    """Voxels of what was measured."""
    tolerance: Tolerance
    """What the scene allows."""
    driver: Driver
    """The OpenGL ES that drew."""
    seconds: NonNegative
    """What the measurement took."""
    curves: tuple[Curve, ...]
    """One for each choice."""


def plotted_cost(point: CurvePoint, cost: Cost) -> float:
    """Return what a variant costs, in the unit of its name."""
    costs = {
        "milliseconds": point.wall.median,
        "bytes": point.upload_bytes / 1e6,
        "seconds": point.build_seconds,
    }
    return costs[cost]
