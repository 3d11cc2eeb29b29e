"""A walk through a package with sub-volumes, as a user makes it: a TOML file with a table [[step]] for each picture."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from volprep.scene.points import PhysicalValue
from volprep.scene.scene import read_toml
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.transfer_function import MOST_OPAQUE, Fraction, TransferFunction, TransferPoint
from volprep_formats.record import Record, problems


class ShownValues(Record):
    """Shown values and their opacity: the variables of the Beaver Volume Renderer (Schultz and Bailey, 7.2.3)."""

    alpha: Fraction | None = None
    """Opacity of all values that are shown, for the reference length of the transfer function; if absent, each has that
    of the transfer function."""
    minimum: PhysicalValue | None = None
    """Values below this are not shown."""
    maximum: PhysicalValue | None = None
    """Values above this are not shown."""

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        if self.minimum is not None and self.maximum is not None and not self.minimum < self.maximum:
            msg = f"minimum {self.minimum:g} is not below maximum {self.maximum:g}"
            raise ValueError(msg)
        return self

    @property
    def is_plain(self) -> bool:
        """Whether the transfer function stays as it is."""
        return self == ShownValues()

    def of(self, function: TransferFunction) -> TransferFunction:
        """Return what these variables make of a transfer function."""
        values = [point.value for point in function.points]
        columns = np.array([[*point.colour, point.extinction_per_mm] for point in function.points])
        if self.alpha is not None:
            columns[:, 3] = -np.log1p(-min(self.alpha, MOST_OPAQUE)) / function.reference_mm
        below = -np.inf if self.minimum is None else self.minimum
        above = np.inf if self.maximum is None else self.maximum
        kept = [(at, row) for at, row in zip(values, columns, strict=True) if below < at < above]
        if self.minimum is not None:
            edge = _at(self.minimum, values, columns, upper=True)
            kept = [(below, edge * (1, 1, 1, 0)), (below, edge), *kept]
        if self.maximum is not None:
            edge = _at(self.maximum, values, columns, upper=False)
            kept += [(above, edge), (above, edge * (1, 1, 1, 0))]
        points = tuple(
            TransferPoint(value=at, colour=(row[0], row[1], row[2]), extinction_per_mm=row[3]) for at, row in kept
        )
        return function.model_copy(update={"points": points})


def _at(value: float, values: list[float], columns: Float64Array, *, upper: bool) -> Float64Array:
    """Return colour and extinction at a value; at a jump, one of the two sides."""
    for (low, high), (before, after) in zip(pairwise(values), pairwise(columns), strict=True):
        if low == high == value:
            return np.array(after if upper else before)
    return np.array([np.interp(value, values, column) for column in columns.T])


class WalkStep(ShownValues):
    """Changes before the next picture. Absent fields keep their value, even `alpha`, `minimum` and `maximum`."""

    view: str | None = None
    """Look from a standard view: anterior, posterior, left, right, superior, inferior, anterior-left, anterior-right
    or posterior-left."""
    turn: tuple[float, float] | None = None
    """Degrees that the viewer goes around the object: to his right, then up."""
    zoom: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    """How many times larger the volume is than where its diagonal fills the picture. The level follows."""
    move: Literal["forward", "back"] | None = None
    """Walk to another point of the grid, along the direction of view or against it."""
    cut: tuple[float, float, float] | None = None
    """Take a box of the full resolution around this voxel of level 0, x, y and z, and show it."""
    tap: tuple[Fraction, Fraction, Fraction] | None = None
    """The same around a place of the volume shown, in its overall coordinates: 0 to 1 along x, y and z."""
    cut_size: Annotated[int, Field(ge=1, le=2048)] = 64
    """Voxels of the box along each axis."""
    show: Literal["grid", "cut", "place"] = "grid"
    """"grid": a level, or the sub-volumes around a point, as the zoom asks for it. "cut": the box that was cut last.
    "place": the whole volume, with this box marked. `cut` and `tap` show the box, too."""

    @model_validator(mode="after")
    def _cuts_once(self) -> Self:
        if self.cut is not None and self.tap is not None:
            msg = "it has cut and tap, which both name the middle of a box"
            raise ValueError(msg)
        return self

    @property
    def cuts(self) -> bool:
        """Whether it takes a box."""
        return self.cut is not None or self.tap is not None

    @property
    def show_of(self) -> Literal["grid", "cut", "place"]:
        """Description of the picture."""
        return "cut" if self.cuts and self.show == "grid" else self.show


class GridWalk(Record):
    """A walk: a picture for each step."""

    size: Annotated[int, Field(ge=16, le=4096)] = 256
    """Width and height of the pictures in pixels."""
    transfer: str | None = None
    """Transfer function; if absent, the default one."""
    step: Annotated[tuple[WalkStep, ...], Field(min_length=1, max_length=1000)]
    """The steps. Before the first one the viewer looks at the whole volume from the front."""


def load_walk(path: Path) -> GridWalk:
    """Read the file of a walk. Raises VP3001 and VP3002 for one that is missing or no TOML, VP3180 for a wrong key."""
    table = read_toml(path)
    try:
        return GridWalk.model_validate(table)
    except ValidationError as error:
        raise VolprepError("VP3180", path=path, problems=problems(error)) from error
