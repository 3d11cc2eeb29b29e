"""The loss of a picture where a brick is drawn from the next coarser level.

Both are classified at the brick's voxels, and composited through the brick along each axis in both directions: columns
of light. If the light of a column changes by ΔC and its opacity by ΔA, its pixel changes by at most the greater of
|ΔC| and |ΔC - ΔA|, whatever lies behind it, and by less where something lies in front of it. The loss is the root mean
square of that over the columns, in the direction where it is greatest. A pixel that is wider than a voxel is the mean
of the columns in it, whose differences cancel in part.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.kernels import _native
from volprep.parts.on_demand.levels import BrickRow
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.parts.on_demand.index import LOSS_FOOTPRINTS

Spacing = tuple[float, float, float]
_BETWEEN = 16
"""Entries of a table between two codes of 8 bits."""
OUTSIDE = 1 / 8
"""Share of the layer around a brick: half a voxel of it lies in the brick, mixed with at least half a voxel of the
inner one, a quarter in the mean."""


@dataclass(frozen=True)
class CodeLook:
    """Colour and extinction per millimetre, [entry, RGBA], at even distances from code 0 to the largest one."""

    entries: Float32Array
    """The entries."""
    per_code: float
    """Entries from one code to the next."""

    @classmethod
    def of(cls, table: Table, window: tuple[float, float], bits: int) -> "CodeLook":
        """Return the look of a transfer function of codes with so many bits."""
        codes = 2**bits - 1
        count = codes * _BETWEEN + 1 if bits == 8 else codes + 1
        colour, extinction_per_mm = table.at(np.linspace(*window, count))
        return cls(np.column_stack([colour, extinction_per_mm]).astype(np.float32), (count - 1) / codes)

    def slabs(self, spacing_mm_zyx: Spacing) -> Float32Array:
        """Return premultiplied colour and opacity [axis, 2, entry, RGBA] of a voxel, and of one around a brick."""
        lengths_mm = np.outer(spacing_mm_zyx, (1.0, OUTSIDE))
        opacity = -np.expm1(-lengths_mm[:, :, None] * self.entries[:, 3].astype(np.float64))[..., None]
        return np.concatenate([opacity * self.entries[:, :3], opacity], axis=-1).astype(np.float32)


class BrickLosses:
    """The losses of the bricks of one level."""

    def __init__(self, looks: Sequence[CodeLook], spacing_mm_zyx: Spacing, soft_per_mm: float | None) -> None:
        """Take the looks, the distance of voxels, and the slope in codes below which a place is hardly a surface.

        With a slope each sample is lit from where its column is seen.
        """
        self._slabs = np.stack([look.slabs(spacing_mm_zyx) for look in looks])
        self._per_code = looks[0].per_code
        self._spacing_mm_zyx = spacing_mm_zyx
        self._soft_per_mm = soft_per_mm or 0.0

    def of_row(self, row: BrickRow) -> Float64Array:
        """Return for each brick its loss by the width of a pixel, its opacity along x, y and z, and its cover.

        Opacity is a mean over the columns, cover the part of them in which something is seen; both are the least of
        any transfer function.
        """
        numbers = np.empty((row.count, len(LOSS_FOOTPRINTS) + 4))
        _native.brick_losses(
            row.voxels,
            row.inner_zyx,
            row.size,
            row.ghost,
            row.coarse,
            *row.places_zyx,
            self._slabs,
            self._per_code,
            OUTSIDE,
            self._spacing_mm_zyx,
            self._soft_per_mm,
            numbers,
        )
        return numbers
