"""One channel of a volume in colour whose voxels, of three or four components each, lie in a file.

Components are red, green, blue and alpha: integers are sRGB over the whole range of their type, floats linear light.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Progress
from volprep_formats.readers.colour import channel_of_colours, colour_remarks, of_colour
from volprep_formats.readers.voxel_file import VoxelFile
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, source_of
from volprep_formats.source import ColourChannel, SourceInfo

_NAMES = "RGBA"


def voxel_type(path: Path, component: np.dtype[np.generic], count: int | None) -> np.dtype[np.generic]:
    """Return the type of voxels in colour, of `count` components each; that of a number itself if None.

    Raises VP1290 where they are no RGB or RGBA.
    """
    if count is None:
        return component
    if count not in {3, 4}:
        raise VolprepError("VP1290", path=path, problem=f"it has {count} component(s) in each voxel, not 3 or 4")
    if component.kind != "f" and not (component.kind == "u" and component.itemsize <= 2):
        problem = f"its components are of type {component.name}, not uint8, uint16 or floating point"
        raise VolprepError("VP1290", path=path, problem=problem)
    return np.dtype([(name, component) for name in _NAMES[:count]])


def open_voxels(
    facts: HeaderFacts,
    voxels: VoxelFile,
    wanted: ColourChannel | None,
    progress: Progress,
    *,
    most_bytes_after: int | None = 0,
) -> VoxelSource:
    """Return the source of voxels that are numbers, or of one channel of voxels in colour if one is wanted.

    Raises what `source_of` and `ColourVoxels` raise.
    """
    if wanted is None:
        return source_of(facts, voxels, progress, most_bytes_after=most_bytes_after)
    return ColourVoxels(facts, voxels, wanted, most_bytes_after=most_bytes_after)


class ColourVoxels(VoxelSource):
    """Premultiplied linear light, or extinction, of colours and straight alpha."""

    def __init__(
        self, facts: HeaderFacts, voxels: VoxelFile, wanted: ColourChannel, *, most_bytes_after: int | None = 0
    ) -> None:
        """Take a file of voxels of a `voxel_type` of colours.

        Closes it and raises VP1290 for numbers, or for an extinction from an alpha that is not there.
        """
        if voxels.dtype.names is None:
            voxels.close()
            raise VolprepError(
                "VP1290", path=voxels.path, problem=f"its voxels are numbers of type {voxels.dtype.name}"
            )
        self._wanted = wanted
        components = [component for component, *_ in (voxels.dtype.fields or {}).values()]
        self._component = components[0].newbyteorder("=")
        has_alpha, is_linear = len(components) == len(_NAMES), self._component.kind == "f"
        info = SourceInfo(
            format=facts.format,
            grid=facts.grid,
            stored_type="uint8",
            remarks=(*facts.remarks, *colour_remarks(wanted, has_alpha=has_alpha, is_linear=is_linear)),
        )
        super().__init__(of_colour(info), voxels, most_bytes_after=most_bytes_after)
        try:
            self.read_slab(0, 1)
        except VolprepError:
            voxels.close()
            raise

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x]. Raises what `VoxelSource.read_slab` raises, and VP1290."""
        slab = self.read_unrounded(z0, z1)
        pixels = slab.view(self._component).reshape(*slab.shape, -1)
        alpha = pixels[..., 3] if pixels.shape[-1] > 3 else None
        return channel_of_colours(self._voxels.path, self._wanted, pixels[..., :3], alpha)
