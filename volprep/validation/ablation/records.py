"""What ablation found, as frozen records. The page shows nothing else."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.values import ByteCount
from volprep_formats.record import Record

Size = Annotated[float, Field(ge=0.0)]
Outcome = Literal[
    "earns its place",
    "does not earn its place",
    "rightly left out",
    "traded for bytes",
    "wrongly left out",
    "not told apart",
    "cannot be had",
]
"""Of an item that is kept: whether it is worth what it costs. Of one that is not: whether anybody would miss it; traded
for bytes: one might, but the tolerance of the scene allows it. Not told apart: times spread more than what they differ
by. Cannot be had: this scan, or this class of devices, has no such package."""
FAULTS: frozenset[Outcome] = frozenset(("does not earn its place", "wrongly left out"))
"""Outcomes by which the plan is wrong, where it decides."""


class Ratio(Record):
    """How much longer a picture takes than one of the planned package; both were drawn in turns, over and over."""

    median: Size
    """Median over the turns."""
    low: Size
    """First quartile."""
    high: Size
    """Third quartile."""
    turns: Count
    """How many turns there were."""


class Measurement(Record):
    """One package: what it takes, and how near its pictures are to the scan."""

    package_bytes: ByteCount
    """All files but the manifest."""
    upload_bytes: ByteCount
    """What an app uploads to draw the finest level, the sum over the transfer functions that were drawn."""
    gpu_bytes: ByteCount
    """The memory that it takes on a device."""
    milliseconds: Size
    """Median time of a picture in the view that is timed, the sum over the transfer functions."""
    ratio: Ratio | None = None
    """Time of a picture over that of the planned package; null for the planned package itself."""
    rmse: Size
    """Root mean square error against the scan, of the worst view."""
    maximum: Size
    """Largest error of a channel of a pixel against the scan, in any view."""


class AblationRow(Record):
    """One item, taken out of the package if it is kept, put into it if it is not."""

    item: str
    """What it is."""
    transfer: str | None = None
    """Transfer function that it is for; null if it is for all."""
    kept: bool
    """Whether the plan keeps it."""
    chosen_by: Literal["plan", "scene"]
    """Whether the plan decides about it, or the scene alone."""
    reason: str | None
    """Why, in the words of the plan; null where it does not say."""
    other: Measurement | None
    """The package with it taken out, or put in; null where there is no such package."""
    change_rmse: Size | None = None
    """How far the pictures of that package are from those of the planned one: root mean square of the worst view. Both
    are drawn into a float target, with steps so short that it does not matter where samples lie."""
    change_maximum: Size | None = None
    """The same as the largest difference of a channel of a pixel, in any view."""
    outcome: Outcome
    """What follows."""
    finding: str
    """Why it follows, in words."""


class Ablation(Record):
    """What every item of a package is worth."""

    profile: str
    """Class of devices."""
    transfers: tuple[str, ...]
    """Transfer functions that were drawn."""
    timed_view: str
    """View that was timed. Errors are those of all standard views."""
    picture_size: Count
    """Width and height of the pictures."""
    reduced_by: Count
    """Voxels of the scan, along each axis, that were averaged for the measurement; 1: the scan itself."""
    shape_zyx: tuple[Count, Count, Count]
    """Voxels of level 0 of the planned package."""
    tolerance: Tolerance
    """What the scene allows."""
    most_change: Size
    """How much a view may change at most if something is put in that was left out."""
    renderer: str
    """The OpenGL ES that drew."""
    clock: Literal["wall", "processor"]
    """What times are told by: where the processor draws, its time, which other programs hardly disturb."""
    seconds: Size
    """What the measurement took."""
    planned: Measurement
    """The package as planned."""
    noise: Ratio
    """Time of the planned package over itself, measured in the same way: what is not beyond this is noise."""
    everything: Measurement | None
    """The package with everything that could be put in at once; null where that cannot be."""
    everything_has: tuple[str, ...]
    """What that one has beside what the plan keeps."""
    rows: tuple[AblationRow, ...]
    """Every item."""
    not_measured: tuple[str, ...] = ()
    """What was left out of the measurement, and why."""

    @property
    def faults(self) -> tuple[str, ...]:
        """Items about which the plan is wrong, by its own measure; what the scene asks for is no fault of the plan."""
        return tuple(name_of(row) for row in self.rows if row.outcome in FAULTS and row.chosen_by == "plan")


def name_of(row: AblationRow) -> str:
    """Return the name of an item for people."""
    return row.item if row.transfer is None else f"{row.item} of {row.transfer}"
