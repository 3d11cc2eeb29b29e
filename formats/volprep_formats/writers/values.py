"""Values that a volume is written with: stored values without slope, intercept and unit, or physical values."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.opened_source import OpenedSource
from volprep_formats.source import SourceInfo, VolumeSource

_PLAIN: dict[str, object] = {"slope": 1.0, "intercept": 0.0}


class StoredValues(OpenedSource):
    """Stored values alone: slope 1, intercept 0, no unit."""

    def __init__(self, source: VolumeSource) -> None:
        super().__init__(source.info, source)
        self._source = source

    @property
    def info(self) -> SourceInfo:
        """Facts of the source, without slope, intercept and unit."""
        return self._source.info.model_copy(update={**_PLAIN, "unit": ""})

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x]."""
        return self._source.read_slab(z0, z1)


class PhysicalValues(StoredValues):
    """Physical values as float32, for formats that have no slope; stored values where they are the physical ones."""

    @property
    def info(self) -> SourceInfo:
        """Facts of the source, with the type of the written values."""
        info = self._source.info
        return info if _is_plain(info) else info.model_copy(update={**_PLAIN, "stored_type": "float32"})

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Physical values of slices z0 to z1 - 1 as [z, y, x]."""
        info, slab = self._source.info, self._source.read_slab(z0, z1)
        if _is_plain(info):
            return slab
        physical = slab.astype(np.float64) * info.slope + info.intercept
        return physical.astype(np.float32)


def _is_plain(info: SourceInfo) -> bool:
    return (info.slope, info.intercept) == (1.0, 0.0)
