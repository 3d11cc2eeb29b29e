"""Colours of a package as other programs keep them: sRGB bytes and straight alpha, from premultiplied linear light."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.package.manifest import Manifest
from volprep_formats.source import SourceInfo, VolumeSource
from volprep_formats.srgb import srgb_of_linear
from volprep_formats.writers.values import StoredValues

_PLAIN: dict[str, object] = {"stored_type": "uint8", "slope": 1.0, "intercept": 0.0, "unit": ""}


def in_colour(manifest: Manifest) -> bool:
    """Return whether the channels of a package are red, green, blue and opacity of a volume in colour."""
    return any(picture.mixing == "colour" for picture in manifest.pictures)


class StraightColours(StoredValues):
    """Voxels of one level in colour, as pixels [z, y, x, (red, green, blue, alpha)]."""

    def __init__(self, channels: Sequence[VolumeSource]) -> None:
        """Take the channels of a level: premultiplied red, green and blue, and opacity."""
        super().__init__(channels[0])
        self._channels = channels

    @property
    def info(self) -> SourceInfo:
        """Facts of the level, with bytes in place of light."""
        return self._source.info.model_copy(update=_PLAIN)

    def read_slab(self, z0: int, z1: int) -> UInt8Array:
        """Pixels of slices z0 to z1 - 1. Where nothing is opaque, they are black."""
        light: list[Float64Array] = [_physical(channel, z0, z1) for channel in self._channels]
        opacity = light[3]
        pixels = [
            srgb_of_linear(np.clip(np.divide(part, opacity, out=np.zeros_like(part), where=opacity > 0.0), 0.0, 1.0))
            for part in light[:3]
        ]
        encoded: UInt8Array = np.rint(255 * np.stack([*pixels, opacity], axis=-1)).astype(np.uint8)
        return encoded


class _Component(StoredValues):
    """One component of pixels, as a volume."""

    def __init__(self, colours: StraightColours, index: int) -> None:
        super().__init__(colours)
        self._index = index

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Bytes of slices z0 to z1 - 1 as [z, y, x]."""
        return self._source.read_slab(z0, z1)[..., self._index]


def straight_levels(
    levels: Iterable[tuple[int, tuple[VolumeSource, ...]]],
) -> Iterator[tuple[int, tuple[VolumeSource, ...]]]:
    """Yield each level with red, green, blue and alpha as volumes of bytes."""
    for number, channels in levels:
        colours = StraightColours(channels)
        yield number, tuple(_Component(colours, index) for index in range(len(channels)))


def _physical(source: VolumeSource, z0: int, z1: int) -> Float64Array:
    physical = source.read_slab(z0, z1).astype(np.float64) * source.info.slope + source.info.intercept
    return np.clip(physical, 0.0, 1.0)
