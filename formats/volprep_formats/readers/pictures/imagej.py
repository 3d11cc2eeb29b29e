"""Stacks of ImageJ with channels and frames, and those above 4 GB, whose file describes only the first of its images.

The images of a stack follow each other without gaps, channels fastest, then slices, then frames. Source: FileSaver and
TiffDecoder of ImageJ 1.54 (https://github.com/imagej/ImageJ).
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.readers.ome.tiff_chain import data_of_first_page
from volprep_formats.readers.pictures.file import Page
from volprep_formats.readers.voxel_file import VoxelFile
from volprep_formats.readers.voxel_source import VoxelSource, check_declared, read_voxels
from volprep_formats.source import SourceInfo


class OnePageSource(VoxelSource):
    """Every `step`-th of the images that follow each other in a file, from image `first` on."""

    def __init__(self, info: SourceInfo, images: VoxelFile, first: int, step: int) -> None:
        super().__init__(info, images)
        self._first = first
        self._step = step

    def read_unrounded(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x]. Raises VP1003 or VP1008."""
        places = (self._first + self._step * z for z in range(z0, z1))
        return np.concatenate([read_voxels(self._voxels, place, place + 1) for place in places])


def images_behind(path: Path, page: Page) -> VoxelFile:
    """Open the images of a file that describes only the first one, `page`. Raises VP1008 or VP1166."""
    found = data_of_first_page(path)
    dtype = np.dtype(page.stored_type)
    if found is None or page.channels != 1 or page.bits != 8 * dtype.itemsize:
        raise VolprepError("VP1166", path=path, what=SafeText("one page for many images that are packed or in colour"))
    start, order = found
    shape = (page.images, page.rows, page.columns)
    size = path.stat().st_size
    check_declared(path, page.images * page.rows * page.columns * dtype.itemsize, start, 0, size)
    return VoxelFile(path, dtype.newbyteorder(order), shape, start)
