"""Records of the measurements and decisions made while levels were built."""

from typing import Literal

from volprep_formats.package.channel import LevelFilter
from volprep_formats.record import Record

WORSE_THAN_MEANS = 1.05
"""A level may be worse than box means by a twentieth."""


class AdaptedTable(Record):
    """The lookup table of one transfer function for one level."""

    transfer: str
    """Name of the transfer function."""
    entries: tuple[tuple[float, float, float, float], ...]
    """Linear colour and extinction per millimetre."""


class Trial(Record):
    """One way to make a level, and how far it is from level 0 through one transfer function."""

    filter: LevelFilter
    """Filter."""
    transfer: str
    """Transfer function."""
    on: Literal["whole", "blocks"] = "whole"
    """Whether the whole level was made, or blocks of it, to find out which filters are worth that."""
    table: Literal["common", "adapted"]
    """Whether with the table of level 0, or one fitted to the level."""
    rmse: float
    """Root mean square over channels, and over random rays that show something, of the difference of light."""
    seen_rmse: float | None = None
    """The same over rays that are aimed at visible voxels: choices depend on it, and on kept light. None for classified
    voxels."""
    kept_light: float = 1.0
    """Light of the level over that of level 0, along these rays; 1 if right."""
    seconds: float
    """Cost of making the level, and the table if it is an adapted one."""

    @property
    def error(self) -> float:
        """Error along aimed rays; along random ones if there are no others."""
        return self.rmse if self.seen_rmse is None else self.seen_rmse


class LightError(Record):
    """How far a level, as it was made, is from level 0 through one transfer function."""

    transfer: str
    """Transfer function."""
    rmse: float
    """Root mean square over channels, and over random rays that show something, of the difference of light as the
    package draws it: with the tables, the compositing and the lighting that it has."""


class MeasuredStep(Record):
    """How far apart the samples of a ray may be in one level."""

    step_mm: float
    """Distance of the samples."""
    reason: str
    """Why."""


class DroppedTable(Record):
    """A lookup table of a level's own that brings the light nearer to that of level 0, but not if it is lit."""

    transfer: str
    """Transfer function."""
    rmse: float
    """Error of the lit light with this table, as in `LightError`."""
    common_rmse: float
    """Its error with the common table, which is smaller."""


class PictureErrors(Record):
    """How far a refined level and another one are from level 0 in pictures."""

    refined: float
    """Root mean square over channels, and over the rays of some views that show something, of the difference of light;
    the mean over transfer functions."""
    other: float
    """The same of the other one."""


class LevelChoice(Record):
    """The choice for one level, and its candidates."""

    level: int
    """Number of the level."""
    filter: LevelFilter
    """Filter that made it."""
    tables: tuple[AdaptedTable, ...] = ()
    """Lookup tables of its own, for those transfer functions that gain by them."""
    dropped: tuple[DroppedTable, ...] = ()
    """Tables that a lit level does not take, because they bring its light further away."""
    trials: tuple[Trial, ...] = ()
    """Everything that was tried; nothing where there was no choice."""
    beyond_budget: bool = False
    """Whether the level was not refined because that would cost more than the scene's `refine` allows."""
    refused: PictureErrors | None = None
    """Why a refined level that is nearer along aimed rays was not taken: in pictures it is not."""
    lit: PictureErrors | None = None
    """A level that was refined through lit rays, and as its filter made it, in lit pixels: the nearer one is the level.
    None where light is not lit, and beyond the budget."""
    beyond_lit_budget: bool = False
    """Whether the level was not refined through lit rays because that would cost more than `refine` allows."""
    errors: tuple[LightError, ...] = ()
    """Difference between the chosen level and level 0, for each transfer function."""
    step: MeasuredStep | None = None
    """The step that was measured on the level; None if the scene or the plan says it, or nothing is seen."""

    @property
    def tried(self) -> tuple[LightError, ...]:
        """Measurements of the chosen candidate when it was tried: with its own table where it has one."""
        return tuple(LightError(transfer=trial.transfer, rmse=trial.rmse) for trial in self.chosen)

    @property
    def chosen(self) -> tuple[Trial, ...]:
        """Trials of the chosen candidate, for each transfer function with its own table where the level has one."""
        own = {table.transfer for table in self.tables}
        of_filter = (trial for trial in self.trials if (trial.filter, trial.on) == (self.filter, "whole"))
        return tuple(trial for trial in of_filter if (trial.table == "adapted") == (trial.transfer in own))

    @property
    def without_tables(self) -> "LevelChoice":
        """The choice without the tables, which are in the package."""
        return self.model_copy(update={"tables": ()})
