"""Voxels stored contiguously in a file, from some byte on, plain or gzipped; read slab by slab.

Plain files are read rather than mapped: a mapped file that shrinks kills the process, and mapped pages count as memory
in use. A gzip stream has no index, so slabs come fastest in ascending order; going back restarts the stream.
"""

import gzip
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.unpacking import ForwardStream, Stream
from volprep_formats.regular_files import is_gzip, open_gzipped, open_unbuffered, open_unpacked

MAX_DEFLATE_RATIO = 1032
"""No deflate stream unpacks to more times its size: two bits give at most 258 bytes."""
LONGEST = {"slices": 2**16, "rows": 2**18, "columns": 2**18}
"""Rays along a scan are kept whole, and labels are read slice by slice."""

_SKIP_BYTES = 2**20


def head_of(path: Path, count: int) -> bytes:
    """Return the first bytes of a file, unpacked if it is gzipped. Raises VP1005 for a damaged stream, and OSError."""
    with open_unpacked(path) as file:
        try:
            return file.read(count)
        except (EOFError, zlib.error, OSError) as error:
            if isinstance(error, OSError) and error.errno is not None:
                raise
            raise VolprepError("VP1005", path=path, error=error or "it ends too early") from error


def possible_ends(path: Path) -> tuple[int, int]:
    """Return the least and the greatest position after the last voxel: the size of a file that is not gzipped."""
    size = path.stat().st_size
    return (0, size * MAX_DEFLATE_RATIO) if is_gzip(path) else (size, size)


def check_axes(path: Path, shape_zyx: tuple[int, int, int]) -> None:
    """Raise VP1310 if a volume is too long. A small packed file may hold any number of slices of one voxel."""
    for count, (axis, most) in zip(shape_zyx, LONGEST.items(), strict=True):
        if count > most:
            raise VolprepError("VP1310", path=path, count=count, axis=axis, most=most)


class VoxelFile:
    """`shape_zyx` voxels of `dtype` from `offset_bytes` on. The caller has checked the size of a plain file.

    They are read from `stream` if given; otherwise from the file itself, unzipped if it starts with the gzip signature.
    If each voxel has several values beside each other, `values` is their number, and `value` the index of the one read.
    Raises VP1310 for too long an axis.
    """

    def __init__(
        self,
        path: Path,
        dtype: np.dtype[np.generic],
        shape_zyx: tuple[int, int, int],
        offset_bytes: int,
        stream: Stream | None = None,
        *,
        values: int = 1,
        value: int = 0,
    ) -> None:
        check_axes(path, shape_zyx)
        self.path = path
        self.dtype = dtype
        self.shape_zyx = shape_zyx
        self.offset_bytes = offset_bytes
        self._values, self._value = values, value
        self.slice_bytes = shape_zyx[1] * shape_zyx[2] * values * dtype.itemsize
        self.end_bytes = offset_bytes + shape_zyx[0] * self.slice_bytes
        """Position after the last voxel; in a gzipped file, of the unpacked data."""
        self.is_gzip = stream is None and is_gzip(path)
        self.is_packed = self.is_gzip or isinstance(stream, ForwardStream)
        self._file: Stream
        if stream is not None:
            self._file = stream
        else:
            self._file = open_gzipped(path) if self.is_gzip else open_unbuffered(path)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Voxels of slices z0 to z1 - 1 as [z, y, x], in native byte order.

        Raises VolprepError VP1003 when the file cannot be read, VP1005 when a gzip stream is damaged and EOFError
        when it ends before the slab does.
        """
        slab = np.empty((z1 - z0, *self.shape_zyx[1:], self._values), dtype=self.dtype)
        view = slab.reshape(-1).view(np.uint8).data
        try:
            self._file.seek(self.offset_bytes + z0 * self.slice_bytes)
            while view:
                count = self._file.readinto(view)
                if not count:
                    raise EOFError
                view = view[count:]
        except (zlib.error, OSError) as error:
            raise self._error(error) from error
        wanted = np.ascontiguousarray(slab[..., self._value])
        return wanted.astype(self.dtype.newbyteorder("="), copy=False)

    def at_end(self) -> bool:
        """Whether the last voxels read end the file."""
        try:
            return not self._file.read(1)
        except (EOFError, zlib.error, OSError) as error:
            raise VolprepError("VP1005", path=self.path, error=error or "it ends too early") from error

    def following(self, count: int) -> bytes:
        """Return up to `count` bytes that follow the last voxel. Raises VP1005 for a damaged stream."""
        try:
            self._file.seek(self.end_bytes)
            return self._file.read(count)
        except (EOFError, zlib.error, OSError) as error:
            raise VolprepError("VP1005", path=self.path, error=error or "it ends too early") from error

    def unpacked_bytes(self, limit: int) -> int:
        """Size of the data, unpacked if packed; counting stops beyond `limit`."""
        try:
            if not self.is_packed:
                return self.path.stat().st_size
            self._file.seek(0)
            total = 0
            # read1: at the end of a cut stream, read raises EOFError and loses the bytes before it.
            read = self._file.read1 if isinstance(self._file, gzip.GzipFile) else self._file.read
            while total <= limit and (chunk := read(_SKIP_BYTES)):
                total += len(chunk)
        except EOFError:
            return total
        except (zlib.error, OSError) as error:
            raise self._error(error) from error
        return total

    def _error(self, error: zlib.error | OSError) -> VolprepError:
        """Return VP1003 for a system error, which has a number, and VP1005 for an error of zlib, gzip or bz2."""
        if isinstance(error, OSError) and error.errno is not None:
            return VolprepError("VP1003", path=self.path, error=error.strerror)
        return VolprepError("VP1005", path=self.path, error=error)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
