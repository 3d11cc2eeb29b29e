"""One channel of a volume in colour whose voxels, three or four bytes of red, green, blue and alpha, lie in a file."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.colour import channel_of_colours, colour_remarks, of_colour
from volprep_formats.readers.voxel_file import VoxelFile
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource
from volprep_formats.source import ColourChannel, SourceInfo

RGB, RGBA = (np.dtype([(name, np.uint8) for name in names]) for names in ("RGB", "RGBA"))
"""Types of the voxels in a file."""


class ColourVoxels(VoxelSource):
    """Premultiplied linear light, or extinction, of sRGB colours and straight alpha."""

    def __init__(
        self, facts: HeaderFacts, voxels: VoxelFile, wanted: ColourChannel, *, most_bytes_after: int | None = 0
    ) -> None:
        """Take a file of RGB or RGBA. Closes it and raises VP1290 for an extinction from an alpha that is not there."""
        self._wanted = wanted
        has_alpha = voxels.dtype == RGBA
        info = SourceInfo(
            format=facts.format,
            grid=facts.grid,
            stored_type="uint8",
            remarks=(*facts.remarks, *colour_remarks(wanted, has_alpha=has_alpha, is_linear=False)),
        )
        super().__init__(of_colour(info), voxels, most_bytes_after=most_bytes_after)
        try:
            self.read_slab(0, 1)
        except VolprepError:
            voxels.close()
            raise

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x]. Raises what `VoxelSource.read_slab` raises."""
        slab = self._in_file(z0, z1)
        pixels = slab.view(np.uint8).reshape(*slab.shape, -1)
        alpha = pixels[..., 3] if pixels.shape[-1] > 3 else None
        return channel_of_colours(self._voxels.path, self._wanted, pixels[..., :3], alpha)
