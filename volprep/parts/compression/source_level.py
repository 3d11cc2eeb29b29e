"""A level of a source before it is encoded: its codes, and its values as the oracle draws them."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.plan.records import CropPlan, LevelPlan, QuantizePlan
from volprep.plan.whole_source import WholeSource
from volprep.scan.slabs import slab_ranges
from volprep.scene.scene import SceneRender
from volprep.truth.volume import Medium, Volume
from volprep_formats.arrays import Float32Array
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.transfer_function import TransferFunction


@dataclass(frozen=True)
class LevelData:
    """The level of a source to test, and how it is drawn."""

    level: LevelPlan
    """The level."""
    crop: CropPlan
    """Part of the source that becomes level 0."""
    grid: Grid
    """Grid of level 0."""
    quantize: QuantizePlan
    """Its codes."""
    functions: tuple[TransferFunction, ...]
    """Transfer functions."""
    render: SceneRender
    """Projection and size of the pictures."""
    tolerance: Tolerance
    """Of which codes and blocks together may take half."""


class SourceLevel:
    """A level of a source. Coarser levels are means: the filter that makes them is not chosen yet."""

    def __init__(self, source: WholeSource, data: LevelData) -> None:
        """Reduce the source, if the level is not the finest."""
        self._source = source
        self._data = data
        level = data.level
        self.grid = data.grid if level.index == 0 else data.grid.coarser(level.factors_zyx)
        """Grid of the level."""
        self._reduced = None if level.index == 0 else self._box_reduced()

    def medium(self, function: TransferFunction) -> Medium:
        """Return the values without codes; for level 0 the whole source."""
        if self._reduced is not None:
            return Medium(Volume(self._reduced, self.grid), function)
        volume, info = self._source.volume, self._source.info
        stored: NDArray[np.generic] = np.memmap(volume.path, volume.dtype, "r", shape=volume.shape_zyx)
        return Medium(Volume(stored, info.grid, info.slope, info.intercept), function)

    def codes(self, z0: int, z1: int) -> NDArray[Any]:
        """Return the codes of slices z0 to z1 - 1, uint8 or uint16."""
        info = self._source.info
        if self._reduced is None:
            values, slope, intercept = self._part(z0, z1), info.slope, info.intercept
        else:
            values, slope, intercept = self._reduced[z0:z1], 1.0, 0.0
        bits = self._data.quantize.bits
        codes = np.empty(values.shape, np.uint8 if bits == 8 else np.uint16)
        _native.quantize(values, slope, intercept, *self._data.quantize.window, codes, np.zeros(2**bits, np.uint64))
        return codes

    def _part(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Slices z0 to z1 - 1 of the part that becomes level 0, as they are stored."""
        (z, y0, x0), (_, y1, x1) = self._data.crop.start_zyx, self._data.crop.stop_zyx
        return np.ascontiguousarray(self._source.volume.read_slab(z + z0, z + z1)[:, y0:y1, x0:x1])

    def _box_reduced(self) -> Float32Array:
        info, factors = self._source.info, self._data.level.factors_zyx
        depth = self._data.grid.shape_zyx[0]
        means = np.empty(self.grid.shape_zyx, np.float32)
        for z0, z1 in slab_ranges(depth, 4 * math.prod(self._data.grid.shape_zyx[1:]), multiple=factors[0]):
            values = self._part(z0, z1).astype(np.float32) * np.float32(info.slope) + np.float32(info.intercept)
            _native.box_reduce(values, means[z0 // factors[0] : -(-z1 // factors[0])], factors)
        return means
