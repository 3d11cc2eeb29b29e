"""What lights a volume, as the oracles take it: normals of voxels, or slopes as a shader takes them; and a light."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.normals.record import GradientKernel
from volprep_formats.package.program import Light

_LEAST_LENGTH = 0.01
"""What the oracles take for no surface."""


@dataclass(frozen=True)
class ShaderSlopes:
    """Differences of values one voxel apart, between voxels interpolated as they are, not as unit vectors."""

    kernel: Literal["forward", "central"]
    """Which differences."""
    least_per_mm: float
    """Slope, physical per millimetre, that is no surface any more."""

    def scale(self, slope: float) -> float:
        """Return the factor of slopes of stored values after which 0.01 is the least; physical = slope · stored + b."""
        return abs(slope) * _LEAST_LENGTH / self.least_per_mm


VoxelNormals = GradientKernel | Float32Array
"""The kernel that measures gradients, or a vector for each voxel, [z, y, x, (x, y, z)]."""


@dataclass(frozen=True)
class Lit:
    """What lights, where it is not normals of voxels and the viewer."""

    normals: VoxelNormals | ShaderSlopes
    """Where normals come from."""
    light: Light | None = None
    """The light with a place; none where light comes from the viewer."""
    halfway: bool = False
    """Whether highlights are after Blinn, not after Phong."""

    @property
    def throws_shadows(self) -> bool:
        """Whether what lies between the light and a sample takes light away."""
        return self.light is not None and self.light.shadows != "none"


Normals = VoxelNormals | Lit | None
"""What lights a volume: from the viewer, where it is no `Lit`; nothing, where it is none."""


def native_normals(normals: Normals, slope: float) -> tuple[str, Float32Array | None, float]:
    """Return the arguments `kernel`, `normals` and `slope_scale` of the native oracles."""
    source = normals.normals if isinstance(normals, Lit) else normals
    if isinstance(source, ShaderSlopes):
        return source.kernel, None, source.scale(slope)
    if isinstance(source, str):
        return source, None, 0.0
    return "", source, 0.0


def shadow_light(normals: Normals) -> Light | None:
    """Return the light that throws shadows; none where none does."""
    return normals.light if isinstance(normals, Lit) and normals.throws_shadows else None


def place_in_box(light: Light, grid: Grid) -> Float64Array:
    """Return where a light is in the box space of a grid, (x, y, z) in millimetres."""
    place: Float64Array = (np.linalg.inv(grid.world_from_box) @ [*light.place_mm_xyz, 1.0])[:3]
    return place
