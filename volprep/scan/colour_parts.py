"""The channels of a volume in colour from a source that is decoded once: all but the first are kept in a file.

To decode pictures takes most of the time of an import, and each picture holds all channels.
"""

import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from volprep.scan.repair import open_scan
from volprep.scan.slabs import bytes_of
from volprep_formats.output import output_errors
from volprep_formats.progress import Progress
from volprep_formats.readers.colour import PARTS, unpacked
from volprep_formats.source import SourceInfo, SourceSpec, VolumeSource


def is_one_source(specs: list[SourceSpec]) -> bool:
    """Return whether the channels are the four of one volume in colour, whose slices lie as they are stored."""
    parts = [None if spec.colour is None else spec.colour.part for spec in specs]
    return parts == [*PARTS] and not specs[0].repair


@contextmanager
def opened_colours(spec: SourceSpec, folder: Path, progress: Progress) -> Iterator[list["ColourPart"]]:
    """Open the four channels, given one of them as `spec`. Decoded slabs are kept in a nameless file in `folder`.

    Raises the errors of the reader.
    """
    assert spec.colour is not None  # noqa: S101 - see `is_one_source`
    every = spec.model_copy(update={"colour": spec.colour.model_copy(update={"part": "all"})})
    with ExitStack() as opened:
        decoded = _Decoded(opened.enter_context(open_scan(every, Path("/"), progress)), folder, opened)
        yield [ColourPart(decoded, index) for index in range(len(PARTS))]


class _Decoded:
    """All channels of a source, each slice decoded once."""

    def __init__(self, source: VolumeSource, folder: Path, opened: ExitStack) -> None:
        self.info = source.info
        self._source = source
        self._folder = folder
        depth, height, width = source.info.grid.shape_zyx
        self._depth = depth
        self._slice_bytes = height * width * np.dtype(np.uint16).itemsize
        self._is_kept = np.zeros(depth, bool)
        with output_errors(folder):
            self._file = opened.enter_context(tempfile.TemporaryFile(dir=folder))  # noqa: SIM115 - it is closed

    def read(self, index: int, z0: int, z1: int) -> NDArray[np.uint16]:
        """Return slices z0 to z1 - 1 of channel number `index`."""
        if self._is_kept[z0:z1].all():
            return self._kept(index, z0, z1)
        parts = unpacked(self._source.read_slab(z0, z1))
        for number in range(len(PARTS)):
            if number != index:
                self._keep(number, z0, np.ascontiguousarray(parts[..., number]))
        self._is_kept[z0:z1] = index == 0
        return np.ascontiguousarray(parts[..., index])

    def _keep(self, index: int, z0: int, slab: NDArray[np.uint16]) -> None:
        left, offset = bytes_of(slab), (index * self._depth + z0) * self._slice_bytes
        with output_errors(self._folder):
            while left:
                count = os.pwrite(self._file.fileno(), left, offset)
                left, offset = left[count:], offset + count

    def _kept(self, index: int, z0: int, z1: int) -> NDArray[np.uint16]:
        offset = (index * self._depth + z0) * self._slice_bytes
        voxels = np.empty((z1 - z0, *self.info.grid.shape_zyx[1:]), "<u2")
        left = bytes_of(voxels)
        while count := os.preadv(self._file.fileno(), [left], offset):
            left, offset = left[count:], offset + count
        return voxels.astype(np.uint16, copy=False)


class ColourPart:
    """One channel."""

    def __init__(self, decoded: _Decoded, index: int) -> None:
        self._decoded = decoded
        self._index = index

    @property
    def info(self) -> SourceInfo:
        """Geometry and type; remarks with the first channel, once."""
        info = self._decoded.info
        return info if self._index == 0 else info.model_copy(update={"remarks": ()})

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x]. Raises the errors of the reader, and VP4020."""
        return self._decoded.read(self._index, z0, z1)

    def __enter__(self) -> Self:
        """Return the channel itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Do nothing: `opened_colours` closes the source."""
