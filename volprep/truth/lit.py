"""Lighting of a volume for the oracles: normals of voxels, or slopes as a shader takes them; and a light."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid, Vector
from volprep_formats.package.parts.normals.record import GradientKernel, HalvedAxes
from volprep_formats.package.program import Light

SOFT_LENGTH = 0.01
"""Length of the normal of a place that counts half as a surface for the oracles."""


@dataclass(frozen=True)
class ShaderSlopes:
    """Differences of values one voxel apart, between voxels interpolated as they are, not as unit vectors."""

    kernel: Literal["forward", "central"]
    """Kernel of the differences."""
    soft_per_mm: float
    """Slope of a place that counts half as a surface, physical per millimetre."""
    range: float = 1.0
    """Physical range of the codes: slopes of borders of segments count as parts of it."""
    halved_zyx: HalvedAxes = (False, False, False)
    """Axes along which central differences use values half a voxel to each side, as on a coarse level."""

    @property
    def border_scale(self) -> float:
        """Return the factor of slopes of borders, beside slopes of values times `scale`."""
        return self.range * SOFT_LENGTH / self.soft_per_mm

    def scale(self, slope: float) -> float:
        """Return the factor of stored slopes that makes half a surface 0.01; physical = slope · stored + b."""
        return abs(slope) * SOFT_LENGTH / self.soft_per_mm


VoxelNormals = GradientKernel | Float32Array
"""The kernel that measures gradients, or a vector for each voxel, [z, y, x, (x, y, z)]."""


@dataclass(frozen=True)
class Lit:
    """Lighting other than by normals of voxels and a headlight."""

    normals: VoxelNormals | ShaderSlopes
    """Source of the normals."""
    light: Light | None = None
    """The light with a place; None for a headlight."""
    halfway: bool = False
    """Whether highlights are after Blinn, not after Phong."""

    @property
    def throws_shadows(self) -> bool:
        """Whether matter between the light and a sample absorbs light."""
        return self.light is not None and self.light.shadows != "none"


@dataclass(frozen=True)
class BakedField:
    """Precomputed light, decoded: first + share · second, both trilinear."""

    texels: Float32Array
    """[z, y, x, 2, channels]: the two numbers of each node; 1 or 3 channels."""
    curve: Float64Array
    """[2, n]: ascending physical values, and the share of the second number at each."""
    nodes_per_mm_xyz: tuple[float, float, float]
    """Nodes for each millimetre along the axes of the box; node k lies k / this from the corner."""
    corner_mm_xyz: Vector
    """Corner of its box in the patient's space (LPS); a volume with a border around it begins elsewhere."""

    def start_mm(self, grid: Grid) -> Vector:
        """Return where its box begins in the box space of a grid with the same axes."""
        x, y, z = (np.linalg.inv(grid.world_from_box) @ [*self.corner_mm_xyz, 1.0])[:3].tolist()
        return x, y, z


@dataclass(frozen=True)
class Baked:
    """Precomputed light, which multiplies colours before any other lighting."""

    fields: Mapping[str, BakedField]
    """Light by the name of its transfer function; without an entry a function has no such light."""
    other: "VoxelNormals | Lit | None"
    """Lighting besides the precomputed one."""


Normals = VoxelNormals | Lit | Baked | None
"""Lighting of a volume; bare normals mean a headlight, None means unlit."""


def native_normals(normals: Normals, slope: float) -> tuple[str, Float32Array | None, float, tuple[bool, bool, bool]]:
    """Return the arguments `kernel`, `normals`, `slope_scale` and `halved` of the native oracles."""
    other = normals.other if isinstance(normals, Baked) else normals
    source = other.normals if isinstance(other, Lit) else other
    if isinstance(source, ShaderSlopes):
        z, y, x = source.halved_zyx
        return source.kernel, None, source.scale(slope), (x, y, z)
    if isinstance(source, str):
        return source, None, 0.0, (False, False, False)
    return "", source, 0.0, (False, False, False)


def shadow_light(normals: Normals) -> Light | None:
    """Return the light that casts shadows, or None."""
    return normals.light if isinstance(normals, Lit) and normals.throws_shadows else None


def place_in_box(light: Light, grid: Grid) -> Float64Array:
    """Return where a light is in the box space of a grid, (x, y, z) in millimetres."""
    place: Float64Array = (np.linalg.inv(grid.world_from_box) @ [*light.place_mm_xyz, 1.0])[:3]
    return place


def light_numbers(normals: Normals, grid: Grid) -> Float64Array | None:
    """Return the argument `light` of the native oracles; None without a light at a place."""
    if not isinstance(normals, Lit) or normals.light is None:
        return None
    light = normals.light
    parts = (light.ambient, light.diffuse, light.specular, light.shininess)
    return np.array([*place_in_box(light, grid), *parts])


def with_baked(normals: Normals, fields: Mapping[str, BakedField]) -> Normals:
    """Return the lighting, with precomputed light if there is any."""
    other = normals.other if isinstance(normals, Baked) else normals
    return Baked(fields, other) if fields else other
