"""Records of what was measured and decided about levels when they were made."""

from typing import Literal

from volprep_formats.package.channel import LevelFilter
from volprep_formats.record import Record


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
    """Root mean square over rays and channels of the difference of light, premultiplied linear."""
    seconds: float
    """What it took to make the level, and the table if it is an adapted one."""


class LightError(Record):
    """How far a level, as it was made, is from level 0 through one transfer function."""

    transfer: str
    """Transfer function."""
    rmse: float
    """Root mean square over random rays and channels of the difference of light, premultiplied linear, as the package
    draws it: with the tables, the compositing and the lighting that it has."""


class LevelChoice(Record):
    """What was chosen for one level, and from what."""

    level: int
    """Number of the level."""
    filter: LevelFilter
    """Filter that made it."""
    tables: tuple[AdaptedTable, ...] = ()
    """Lookup tables of its own, for those transfer functions that gain by them."""
    trials: tuple[Trial, ...] = ()
    """Everything that was tried; nothing where there was no choice."""
    errors: tuple[LightError, ...] = ()
    """How far what was chosen is from level 0, for each transfer function."""

    @property
    def tried(self) -> tuple[LightError, ...]:
        """What was measured of what was chosen when it was tried: with its own table where it has one."""
        own = {table.transfer for table in self.tables}
        return tuple(
            LightError(transfer=trial.transfer, rmse=trial.rmse)
            for trial in self.trials
            if trial.filter == self.filter
            and trial.on == "whole"
            and (trial.table == "adapted") == (trial.transfer in own)
        )

    @property
    def without_tables(self) -> "LevelChoice":
        """The choice without the tables, which stand in the package."""
        return self.model_copy(update={"tables": ()})
