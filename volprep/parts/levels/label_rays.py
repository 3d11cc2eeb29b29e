"""Labels of segments along rays, as factors of each style's colour and extinction.

A sample mixes the eight voxels around it by their trilinear weights. For each style, a shader adds up tint times
opacity factor, and opacity factor, of the voxels whose label has that style. Crisp borders are mixed here too: a step
that is short enough for a border one voxel wide draws a crisp one within half a step of its place.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.headlight import BorderSlopes
from volprep.parts.levels.rays import RaySegments, sample_at
from volprep.scan.segments.record import VoxelBox
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.function_table import Table

_LARGEST = 65535
_LEAST_EXTINCTION = 1e-9


@dataclass(frozen=True)
class LabelLooks:
    """The labels of a volume, and how each looks."""

    labels: RawVolume
    """uint16 [z, y, x]."""
    looks: Float64Array
    """[style, label, 4], 0 to 1: tint times opacity factor, and opacity factor; 0 for labels of another style."""
    boxes: Sequence[VoxelBox] = ()
    """Around the voxels of each segment."""

    def along(
        self, spacing_mm_zyx: tuple[float, float, float], lines: RaySegments, counts: NDArray[np.intp]
    ) -> Float32Array:
        """Return what the labels around each sample of rays add up to [style, sample, 4]."""
        return np.stack(
            [np.stack(self._sampled(spacing_mm_zyx, lines, counts, style.T), axis=-1) for style in self.looks]
        )

    def border_slopes(
        self, spacing_mm_zyx: tuple[float, float, float], tables: Sequence[Table], values: Float64Array, per_mm: float
    ) -> BorderSlopes:
        """Return a function that finds the slope of borders at samples [xyz, sample].

        It is the slope of the logarithm of the visible extinction, with the physical `values` [sample] held, times
        `per_mm`. The difference of trilinear means half a voxel to each side is close to the slope of the quadratic
        B-splines that shaders use.
        """

        def slopes(pieces: RaySegments, counts: NDArray[np.intp], wanted: NDArray[np.bool_]) -> Float64Array:
            extinctions = np.stack([table.at(values[wanted])[1] for table in tables])

            def seen(aside_mm: Float64Array) -> Float64Array:
                moved = RaySegments(pieces.starts_mm_xyz + aside_mm, pieces.directions_xyz, pieces.lengths_mm)
                opacities = [self._sampled(spacing_mm_zyx, moved, counts, look[:, 3:].T)[0] for look in self.looks]
                total: Float64Array = (extinctions * opacities).sum(axis=0)
                return total

            middle = np.maximum(seen(np.zeros(3)), _LEAST_EXTINCTION)
            sides_mm = np.diag(spacing_mm_zyx[::-1]) / 2
            return np.stack([(seen(side) - seen(-side)) * (per_mm / (2 * side.max())) / middle for side in sides_mm])

        return slopes

    def _sampled(
        self,
        spacing_mm_zyx: tuple[float, float, float],
        lines: RaySegments,
        counts: NDArray[np.intp],
        numbers: Float64Array,
    ) -> list[Float32Array]:
        """Return the trilinear means of numbers of labels [number, label] at samples, each of the numbers once."""
        found: dict[bytes, Float32Array] = {}
        for number in numbers:
            key = number.tobytes()
            if key not in found:
                volume = _Numbered(
                    self.labels.path,
                    self.labels.shape_zyx,
                    np.dtype(np.uint16),
                    self.labels,
                    np.rint(number * _LARGEST).astype(np.uint16),
                )
                found[key] = sample_at(volume, spacing_mm_zyx, lines, counts).values / np.float32(_LARGEST)
        return [found[combination.tobytes()] for combination in numbers]


@dataclass(frozen=True)
class _Numbered(RawVolume):
    """A volume of labels, each replaced by a number."""

    labels: RawVolume
    """The labels."""
    numbers: NDArray[np.uint16]
    """Number of each label."""

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Return the numbers of slices z0 to z1 - 1."""
        numbered: NDArray[np.uint16] = self.numbers[self.labels.read_slab(z0, z1)]
        return numbered
