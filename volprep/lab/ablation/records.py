"""Frozen records of ablation.json: the value of each item. The page shows nothing else."""

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
    "not distinguishable",
    "not available",
]
"""For a kept item: whether it is worth its cost. For an item left out: whether it would be missed. Traded for bytes: it
might be missed, but the tolerance of the scene allows it. No measurable difference: times spread more than they differ.
Not available: this scan, or this class of devices, has no such package."""
FAULTS: frozenset[Outcome] = frozenset(("does not earn its place", "wrongly left out"))
"""Outcomes that show a wrong plan, where the plan decides."""


class Ratio(Record):
    """Ratio of a picture's time to the planned package's; both were drawn in turns, many times."""

    median: Size
    """Median over the turns."""
    low: Size
    """First quartile."""
    high: Size
    """Third quartile."""
    turns: Count
    """Number of turns."""


class Measurement(Record):
    """One package: its costs, and the error of its pictures against the scan."""

    package_bytes: ByteCount
    """All files but the manifest."""
    transport_bytes: ByteCount
    """Textures as they go over the network, deflated."""
    upload_bytes: ByteCount
    """Bytes that an app uploads to draw the finest level, summed over the transfer functions that were drawn."""
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
    """Description of the item."""
    transfer: str | None = None
    """Transfer function that it is for; null if it is for all."""
    kept: bool
    """Whether the plan keeps it."""
    chosen_by: Literal["plan", "scene"]
    """Whether the plan decides about it, or the scene alone."""
    reason: str | None
    """Reason, in the words of the plan; null if the plan gives none."""
    other: Measurement | None
    """The package with it taken out, or put in; null if there is no such package."""
    change_rmse: Size | None = None
    """Error of that package's pictures against the planned one's: root mean square of the worst view. Both are drawn
    into a float target, with steps so short that the positions of the samples do not matter."""
    change_maximum: Size | None = None
    """The same as the largest difference of a channel of a pixel, in any view."""
    outcome: Outcome
    """Outcome."""
    finding: str
    """Reason for the outcome, in words."""


class Ablation(Record):
    """Value of every item of a package."""

    generator: str
    """Program and version that measured."""
    package: str
    """Name of the package."""
    profile: str
    """Class of devices."""
    transfers: tuple[str, ...]
    """Transfer functions that were drawn."""
    timed_view: str
    """View that was timed. Errors cover all standard views."""
    picture_size: Count
    """Width and height of the pictures."""
    reduced_by: Count
    """Voxels of the scan, along each axis, that were averaged for the measurement; 1: the scan itself."""
    shape_zyx: tuple[Count, Count, Count]
    """Voxels of level 0 of the planned package."""
    tolerance: Tolerance
    """Tolerance of the scene."""
    most_change: Size
    """Largest change of a view that is allowed when an item that was left out is put in."""
    renderer: str
    """The OpenGL ES that drew."""
    clock: Literal["wall", "processor"]
    """Clock. Software drawing is measured in processor time, which other programs hardly disturb."""
    seconds: Size
    """Duration of the measurement."""
    planned: Measurement
    """The package as planned."""
    noise: Ratio
    """Time of the planned package over itself, measured in the same way: smaller differences are noise."""
    everything: Measurement | None
    """The package with every possible item put in together; null if it cannot be built."""
    everything_has: tuple[str, ...]
    """Items of that package that the plan does not keep."""
    rows: tuple[AblationRow, ...]
    """Every item."""
    not_measured: tuple[str, ...] = ()
    """Items that were not measured, and why."""

    @property
    def faults(self) -> tuple[str, ...]:
        """Items about which the plan is wrong, by its own measure; requests of the scene are not faults of the plan."""
        return tuple(name_of(row) for row in self.rows if row.outcome in FAULTS and row.chosen_by == "plan")


def name_of(row: AblationRow) -> str:
    """Return the name of an item for people."""
    return row.item if row.transfer is None else f"{row.item} of {row.transfer}"
