"""Records of surfaces that leave a package: meshes in the patient's space, and their error against the volume."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.package.look import VolumeLooks
from volprep_formats.record import Record


class SurfaceError(Record):
    """Difference of the surface to what rays from six sides of the volume hit first."""

    rays: int
    """Rays of which the surface or the volume was hit."""
    median_mm: float | None = None
    """Median distance of the two hits along a ray; null where no ray hit both."""
    p95_mm: float | None = None
    """Distance that 95 % of the rays do not exceed."""
    maximum_mm: float | None = None
    """Largest distance."""
    missed: float
    """Share of the rays that hit only one of both."""
    colour_rmse: float | None = None
    """Root mean square difference of the colours of both hits, sRGB from 0 to 1, light left out."""


class SurfaceNode(Record):
    """One mesh of a file."""

    name: str
    """Name of its node."""
    triangles: int
    """Number of triangles."""
    watertight: bool
    """Whether each edge belongs to two triangles."""
    error: SurfaceError
    """Error against the volume."""


class SurfaceFacts(Record):
    """Facts that are written into a file of surfaces."""

    format: Literal["volprep-surface"] = "volprep-surface"
    """Kind of the facts."""
    version: Literal[1] = 1
    """Version of their form."""
    generator: str
    """Program and version."""
    package: str
    """Name of the package."""
    level: int
    """Level that the surface was taken from."""
    function: str
    """Transfer function, or the name of the picture with segments."""
    surface: str
    """Meaning of the surface, in words."""
    units: Literal["millimetres"] = "millimetres"
    """Unit of the positions of the meshes."""
    axes: Literal["LPS"] = "LPS"
    """Axes of the positions: to the patient's left, to the back, to the head."""
    decimated_within_mm: float
    """Distance from the surface of the field, to first order, that 95 % of corners and middles of triangles keep to."""
    nodes: tuple[SurfaceNode, ...]
    """The meshes."""


@dataclass(frozen=True)
class SurfaceMesh:
    """A closed triangle mesh."""

    name: str
    """Name of its node."""
    positions_mm: Float64Array
    """Positions [n, 3] in the patient's space (LPS), millimetres."""
    normals: Float64Array
    """Unit normals [n, 3], outwards."""
    colours: Float64Array
    """Linear RGB [n, 3] from 0 to 1."""
    triangles: NDArray[np.int64]
    """Vertices [m, 3], counter-clockwise from outside."""


@dataclass(frozen=True)
class Surfaces:
    """All meshes of a file."""

    meshes: tuple[SurfaceMesh, ...]
    """The meshes, in the order of `facts.nodes`."""
    facts: SurfaceFacts
    """What is written beside them."""
    looks: VolumeLooks
    """Looks of the package, which glTF holds."""
