"""Cost of drawing a picture at a level, as a plan names it."""

from volprep_formats.grid import Signed
from volprep_formats.package.picture import DrawCost


class LevelCost(DrawCost):
    """Cost of drawing one level of a picture."""

    picture: str
    """Name of the picture."""
    level: Signed
    """Level that is drawn."""
