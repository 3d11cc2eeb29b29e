"""Fidelity of one level's pictures to the scan. An app uses it to choose the level for a picture."""

from typing import Annotated

from pydantic import Field

from volprep_formats.grid import Count, Index
from volprep_formats.record import Record

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Fidelity(Record):
    """Error of one level with one transfer function, against the integral of the scan, in views from all sides.

    Pictures hold the whole volume. A pixel is the mean of at least four rays.
    """

    transfer: str
    """Name of the transfer function."""
    level: Index
    """Level that is drawn, with its own lookup table if it has one."""
    pixels: Count
    """Width and height of the pictures."""
    pixels_per_voxel: Annotated[float, Field(gt=0.0)]
    """Pixels along the shortest edge of a voxel of the level, in the middle of the picture."""
    views: Count
    """Number of views."""
    rmse: Share
    """Root mean square error over all pixels of all views and the four channels, premultiplied linear light. Over other
    views from all sides it is the same within 20 %."""
    maximum: Share
    """No channel of a pixel, in any view from any side, is expected to be further off: the mean of the largest errors
    of the views and nine standard deviations, at least twice the mean, at most 1."""
    flip: Share
    """FLIP, the perceived difference: mean over all pixels that are not transparent and over the views, sRGB, over
    black or over white, whichever is larger, at 67 pixels per degree."""
