"""Proxy geometry of a package: closed meshes around the visible part of the volume. Rays begin and end at them."""

from typing import Annotated, Literal, get_args

from pydantic import Field

from volprep_formats.grid import Count, Index, Vector
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.package.values import PackagePath, Total, open_word
from volprep_formats.record import Record

ProxyForm = Literal["blocks", "merged", "convex", "box"]
"""Outer faces of occupied blocks; the same as rectangles; their convex hull; their bounding box."""
UNITS = 4
"""Units of a position of a mesh in a voxel."""


class ProxyMeshFile(Record):
    """A closed mesh around everything that a transfer function shows of a level."""

    name: str
    """Name, unique in the package."""
    transfer: str
    """Name of the transfer function."""
    level: Index
    """Level."""
    form: Annotated[str, open_word(*get_args(ProxyForm))]
    """Kind of mesh: the outer faces of occupied blocks, the same merged into rectangles, their convex hull, or their
    bounding box. A reader accepts any other word."""
    block: Count
    """Cells along an edge of the blocks that it encloses."""
    file: PackagePath | None = None
    """glTF binary. Absent if the transfer function shows nothing of the level; then nothing is drawn."""
    vertices: Total = 0
    """Number of vertices."""
    triangles: Total = 0
    """Number of triangles."""
    draco: bool = False
    """Whether the mesh is compressed with the extension KHR_draco_mesh_compression."""
    box_from_mesh_mm_xyz: Vector
    """Positions of vertices times this are box millimetres: a quarter of the level's spacing."""
    occupied_share: Fraction
    """Part of the blocks that are occupied."""


class Proxy(Record):
    """Proxy geometry: rays begin where they first meet a mesh, and end where they leave it for good."""

    epsilon: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Largest opacity that a ray may lose because it begins and ends at the mesh."""
    meshes: tuple[ProxyMeshFile, ...] = ()
    """One for each level of each transfer function, if it saves samples."""
