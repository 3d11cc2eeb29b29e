"""Stacks of slices: positions of a level's slices in 2D textures, for devices that draw only textured polygons."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count, Index
from volprep_formats.record import Record

StackAxis = Literal["x", "y", "z"]
"""Index axis that the slices of a stack are perpendicular to."""
AXES: dict[StackAxis, int] = {"x": 2, "y": 1, "z": 0}
"""Place of each axis in [z, y, x]."""


class SliceLayout(Record):
    """Positions of slices in one texture. Tiles abut, row by row from the texel (0, 0)."""

    axis: StackAxis
    """Index axis that the slices are perpendicular to."""
    slice_shape_yx: tuple[Count, Count]
    """Rows and columns of a slice: z and y for the axis x, z and x for y, y and x for z."""
    first: Index
    """Voxel along the axis of the first slice in this texture."""
    slices: Count
    """Number of slices in this texture."""
    tiles_x: Count
    """Tiles in a row: slice `first` + i lies in column i mod tiles_x of row i div tiles_x."""
    largest_opacity: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    """No texel of the stack is more opaque."""
    layers: Count = 1
    """Polygons for each slice. If more than one, each mixes the two slices around it, and a texel has the opacity of
    the distance of polygons."""
