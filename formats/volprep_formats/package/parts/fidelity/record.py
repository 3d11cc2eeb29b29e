"""Fidelity of one level's pictures to the scan. An app uses it to choose the level for a picture."""

from volprep_formats.grid import Index
from volprep_formats.package.picture import Fidelity


class LevelFidelity(Fidelity):
    """Fidelity of one level with one transfer function, with its own lookup table if it has one."""

    transfer: str
    """Name of the transfer function."""
    level: Index
    """Level that is drawn."""

    @property
    def as_record(self) -> Fidelity:
        """Return it as the drawing of this level has it."""
        return Fidelity(**{name: getattr(self, name) for name in Fidelity.model_fields})
