"""Headerless raw voxels, described by the scene: one file, plain or gzipped, or a folder with a file for each slice."""

from contextlib import closing
from functools import partial
from math import prod
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress
from volprep_formats.readers.pictures.names import in_order
from volprep_formats.readers.unpacking import ForwardStream, joined
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO, VoxelFile
from volprep_formats.source import RawLayout, SourceInfo, SourceSpec


class RawSource(OpenedSource):
    """Raw voxels, read slab by slab."""

    def __init__(self, layout: RawLayout, voxels: VoxelFile) -> None:
        grid = Grid.of(layout.shape_zyx, layout.spacing_mm_zyx)
        super().__init__(SourceInfo(format="raw", grid=grid, stored_type=layout.dtype), closing(voxels))
        self._layout = layout
        self._voxels = voxels

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Voxels of slices z0 to z1 - 1 as [z, y, x].

        Raises VolprepError VP1011 when a gzipped file turns out to be shorter or, at its last slice, longer than the
        layout says, and VP1003 or VP1005 when it cannot be read.
        """
        try:
            slab = self._voxels.read_slab(z0, z1)
        except EOFError as error:
            raise self._size_error() from error
        if z1 == self._layout.shape_zyx[0] and not self._voxels.at_end():
            raise self._size_error()
        return slab

    def _size_error(self) -> VolprepError:
        # A malicious stream may unpack without end; beyond twice the size, the exact number is of no use.
        return size_error(self._voxels.path, self._layout, self._voxels.unpacked_bytes(2 * self._voxels.end_bytes))


def open_volume(spec: SourceSpec, path: Path, _progress: Progress) -> RawSource:
    """Open the raw file `path`, or the folder of raw slices, with the layout in `spec`.

    Raises VolprepError VP1010 (no layout), VP1011 and VP1288 (sizes do not match it exactly), VP1161, VP1162
    (numbers of slices) or VP1003.
    """
    layout = spec.raw
    if layout is None:
        raise VolprepError("VP1010", path=path)
    if path.is_dir():
        return _of_slices(layout, path)
    dtype = np.dtype(layout.dtype).newbyteorder("<" if layout.byte_order == "little" else ">")
    voxels = VoxelFile(path, dtype, layout.shape_zyx, layout.header_bytes)
    actual = path.stat().st_size
    impossible = voxels.end_bytes > actual * MAX_DEFLATE_RATIO if voxels.is_gzip else voxels.end_bytes != actual
    if impossible:
        voxels.close()
        raise size_error(path, layout, actual)
    return RawSource(layout, voxels)


def _of_slices(layout: RawLayout, folder: Path) -> RawSource:
    """Open a folder in which each slice is a file, in the order of the number in their names."""
    names = [entry.name for entry in folder.iterdir() if entry.is_file() and not entry.name.startswith(".")]
    nz, ny, nx = layout.shape_zyx
    if len(names) != nz:
        raise VolprepError(
            "VP1288", folder=folder, problem=f"it holds {len(names)} files, but shape_zyx says {nz} slices"
        )
    ordered, _ = in_order(folder, names, "refuse")
    dtype = np.dtype(layout.dtype).newbyteorder("<" if layout.byte_order == "little" else ">")
    slice_bytes = layout.header_bytes + ny * nx * dtype.itemsize
    for name in ordered:
        actual = (folder / name).stat().st_size
        if actual != slice_bytes:
            problem = f"{name} has {actual} bytes, but a slice of {nx}×{ny} voxels needs {slice_bytes}"
            raise VolprepError("VP1288", folder=folder, problem=problem)
    stream = ForwardStream(partial(joined, [folder / name for name in ordered], layout.header_bytes))
    return RawSource(layout, VoxelFile(folder, dtype, layout.shape_zyx, 0, stream))


def size_error(path: Path, layout: RawLayout, actual: int) -> VolprepError:
    """Error for a file of `actual` bytes, with the most likely explanation of its size."""
    nz, ny, nx = layout.shape_zyx
    expected = layout.header_bytes + prod(layout.shape_zyx) * np.dtype(layout.dtype).itemsize
    declared = f"{nx}×{ny}×{nz} voxels of {layout.dtype}"
    if layout.header_bytes:
        declared += f" after {layout.header_bytes} header bytes"
    return VolprepError(
        "VP1011", path=path, declared=declared, expected=expected, actual=actual, hint=_hint(layout, expected, actual)
    )


def _hint(layout: RawLayout, expected: int, actual: int) -> str:
    nz, ny, nx = layout.shape_zyx
    item = np.dtype(layout.dtype).itemsize
    voxels = nz * ny * nx
    payload = actual - layout.header_bytes
    for bytes_per_voxel in (1, 2, 4, 8):
        if payload == voxels * bytes_per_voxel:
            return f"it would fit voxels of {bytes_per_voxel} byte(s), not {item}"
    if payload > 0 and payload % (ny * nx * item) == 0:
        return f"it would fit {payload // (ny * nx * item)} slices, not {nz}"
    extra = actual - expected
    if extra > 0:
        return f"that is {extra} bytes too many, as if the header had {layout.header_bytes + extra}"
    return f"that is {-extra / item:.6g} voxels short"
