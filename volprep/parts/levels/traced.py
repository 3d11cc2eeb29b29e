"""Light of rays through voxels in memory, by the kernel that also gives its adjoint (`trace_light`, `trace_sums`)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.appearance import largest_code
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.rays import RaySegments, ray_counts
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.normals.record import SOFT_SLOPE, halved_axes

TracedRays = tuple[Float64Array, Float64Array, Float64Array, NDArray[np.int64]]
"""Rays as the kernels take them, in voxels: origins, directions, lengths in millimetres, offsets of samples."""


def traced_rays(lines: RaySegments, spacing_mm_zyx: tuple[float, float, float], per_voxel: int) -> TracedRays:
    """Return rays as the kernels take them, with so many samples for each voxel."""
    spacing_mm_xyz = np.array(spacing_mm_zyx[::-1])
    counts = ray_counts(lines.lengths_mm, spacing_mm_zyx, per_voxel=per_voxel)
    return (
        np.ascontiguousarray(lines.starts_mm_xyz / spacing_mm_xyz - 0.5),
        np.ascontiguousarray(lines.directions_xyz / spacing_mm_xyz),
        np.ascontiguousarray(lines.lengths_mm),
        np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)]),
    )


@dataclass(frozen=True)
class Shading:
    """How the samples of a level are lit by the viewer."""

    spacing_mm_zyx: tuple[float, float, float]
    halved_zyx: tuple[bool, bool, bool]
    """Axes along which central differences are of values half a voxel to each side."""
    soft_per_mm: float
    """Slope of a place that counts half as a surface."""

    @classmethod
    def of(cls, scan: LevelInput, factors: Factors) -> "Shading":
        """Return the shading of a level with these factors."""
        soft_per_mm = SOFT_SLOPE / min(scan.grid.spacing_mm_zyx)
        return cls(scan.spacing_mm_zyx(factors), halved_axes(factors), soft_per_mm)

    @property
    def numbers(self) -> tuple[float, ...]:
        """The shading as the kernels take it: spacing and distance of differences by x, y and z, and softness."""
        apart_xyz = (0.5 if halved else 1.0 for halved in self.halved_zyx[::-1])
        return (*self.spacing_mm_zyx[::-1], *apart_xyz, self.soft_per_mm)

    def light(
        self, codes: NDArray[np.generic], lines: RaySegments, table: Float64Array, per_voxel: int
    ) -> tuple[Float64Array, Float64Array]:
        """Return the lit light [n, 4] of rays through codes [z, y, x], and the places [n, 3] where they show most."""
        light, depths_mm = np.empty((len(lines.lengths_mm), 4)), np.empty(len(lines.lengths_mm))
        rays = traced_rays(lines, self.spacing_mm_zyx, per_voxel)
        _native.trace_light(codes, 1.0 / largest_code(codes.dtype), *rays, self.numbers, table, light, depths_mm)
        return light, lines.starts_mm_xyz + depths_mm[:, None] * lines.directions_xyz


def order_in_space(places_mm_xyz: Float64Array, extent_mm: float) -> NDArray[np.intp]:
    """Return the order of places [n, 3] in which neighbours follow each other: along a Z-order curve."""
    cells = np.clip(places_mm_xyz * (1024 / extent_mm), 0, 1023).astype(np.int64)
    code = np.zeros(len(cells), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")
