"""MINC files in a worker process: nibabel and h5py parse them, which no hostile file may crash or flood.

The last file is kept open, so that its slabs follow each other without parsing or unpacking it again.
"""

import json
import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache
from importlib import import_module
from io import BufferedReader
from math import isfinite, prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO
from volprep_formats.readers.voxel_source import check_declared
from volprep_formats.regular_files import is_gzip, open_gzipped, open_unbuffered, open_unpacked

HDF5 = b"\x89HDF\r\n\x1a\n"
_SPATIAL = frozenset(("xspace", "yspace", "zspace"))
_SCANNED_VOXELS = 2**24
_LONGEST_NAME = 40


@dataclass(frozen=True)
class MincFile:
    """A file."""

    path: Path
    token: int
    """Never the same for two sources: the file may have changed between them."""


@dataclass(frozen=True)
class MincSlab:
    """Some slices of one volume."""

    file: MincFile
    volume: int
    """Number of the volume, from 0, along the axes that are not spatial."""
    z0: int
    z1: int
    scaled: bool
    """Whether to return physical values as floats, or values as stored."""


@dataclass(frozen=True)
class MincFacts:
    """Facts from the header, in the file's words. Axes are in the order of the file, the slowest first."""

    shape_zyx: Sequence[int]
    volumes: int
    time: tuple[float, float, str]
    """Step and start of the axis of time, and its unit; an empty unit without such an axis."""
    dtype: str
    steps: Sequence[float]
    cosines: Sequence[Sequence[float]]
    """Direction of each axis in RAS."""
    origin: Sequence[float]
    """First voxel in RAS."""
    units: Sequence[str]
    scale: Sequence[float] | None
    """Slope and intercept of all slices; None if slices have their own."""
    beyond: int
    """Number of voxels outside the valid range."""
    valid: Sequence[float] | None
    """Ends of the valid range of integers."""
    odd_axes: Sequence[str]
    """Axes whose spacing or length is neither right nor missing."""


def facts_of(request: MincFile) -> UInt8Array:
    """Return the fields of `MincFacts` as JSON. Raises VolprepError VP1003, VP1008 or VP1304."""
    with _coded(request.path, "its header is damaged"):
        return np.frombuffer(json.dumps(asdict(_facts(request))).encode(), dtype=np.uint8)


def read_slab(request: MincSlab) -> NDArray[np.generic]:
    """Return slices [z, y, x]. Raises VolprepError VP1003 or VP1304."""
    with _coded(request.file.path, "its voxels are damaged"):
        return _slab(_file(request.file), request)


@contextmanager
def _coded(path: Path, problem: str) -> Iterator[None]:
    """Give each error a code: damaged files end in many kinds of errors of nibabel and h5py."""
    try:
        yield
    except (VolprepError, MemoryError):
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise VolprepError("VP1003", path=path, error=error.strerror or error) from error
        uneven = "rregular spacing" in str(error)
        raise _refusal(path, "its slices lie at uneven distances" if uneven else problem) from error


def _facts(request: MincFile) -> MincFacts:
    path, file = request.path, _file(request)
    names = [str(name) for name in file._dim_names]
    shape = [int(n) for n in file.get_data_shape()]
    _check_axes(path, names, shape)
    dtype = np.dtype(file.get_data_dtype())
    if dtype.kind not in "iuf":
        raise _refusal(path, "its voxels are no grey values")
    _check_data(path, file, prod(shape) * dtype.itemsize)
    valid = _valid_range(path, file, dtype)
    dims = [file._dims[names.index(name)] for name in file._spatial_dims]
    return MincFacts(
        shape_zyx=[shape[names.index(name)] for name in file._spatial_dims],
        volumes=prod(n for name, n in zip(names, shape, strict=True) if name not in _SPATIAL),
        time=_time(names, file),
        dtype=dtype.newbyteorder("=").name,
        steps=[float(getattr(dim, "step", 1.0)) for dim in dims],
        cosines=[_cosines(name, dim) for name, dim in zip(file._spatial_dims, dims, strict=True)],
        origin=[float(value) for value in file.get_affine()[:3, 3]],
        units=[_text(getattr(dim, "units", b"mm")) for dim in dims],
        scale=_scale(path, file, valid),
        beyond=0 if valid is None else _count_beyond(file, dtype, valid),
        valid=None if valid is None else [float(end) for end in valid],
        odd_axes=[name for name, dim, n in zip(names, file._dims, shape, strict=True) if _is_odd(dim, n)],
    )


def _time(names: Sequence[str], file: Any) -> tuple[float, float, str]:
    if "time" not in names:
        return 0.0, 0.0, ""
    axis = file._dims[names.index("time")]
    numbers = (float(np.ravel(getattr(axis, name, 0.0))[0]) for name in ("step", "start"))
    step, start = (number if isfinite(number) else 0.0 for number in numbers)
    return step, start, _text(getattr(axis, "units", b""))


def _check_axes(path: Path, names: Sequence[str], shape: Sequence[int]) -> None:
    """Refuse axes other than x, y, z and time, each once, and impossible sizes. Raises VP1304."""
    if not _SPATIAL <= {*names} <= _SPATIAL | {"time"} or not len({*names}) == len(names) == len(shape):
        # Names of a file are not `SafeText`: they may be anything.
        found = ", ".join(name[:_LONGEST_NAME] for name in names)
        raise VolprepError("VP1304", path=path, problem=f"its axes are {found}; x, y, z and time are read")
    if not all(1 <= n <= LONGEST_AXIS for n in shape):
        raise _refusal(path, f"its header says {'×'.join(map(str, shape))} voxels")


def _valid_range(path: Path, file: Any, dtype: np.dtype[Any]) -> NDArray[np.float64] | None:
    """Return the ends of the valid range of integers, None for floats. Raises VP1304."""
    if dtype.kind == "f":
        return None
    valid: NDArray[np.float64] = file._get_valid_range()
    if not valid[0] < valid[1]:
        raise _refusal(path, f"its valid range is {valid[0]:g} to {valid[1]:g}")
    return valid


@lru_cache(maxsize=1)
def _file(request: MincFile) -> Any:
    """Open a file of either version; nibabel has no types, so it is Any here and above."""
    path = request.path
    is_packed = is_gzip(path)
    with open_unpacked(path) as file:
        is_hdf5 = file.read(len(HDF5)) == HDF5
    with _coded(path, "its header is damaged, or not that of MINC"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # nibabel warns of odd spacings; `_is_odd` finds them
        return _opened_minc2(path) if is_hdf5 else _opened_minc1(path, is_packed=is_packed)


class _BoundedReader(BufferedReader):
    """A file that allocates no more than it holds, whatever size a damaged header asks for."""

    def read(self, size: int | None = -1) -> bytes:
        """Return the next `size` bytes, or the rest if there are less."""
        left = os.fstat(self.fileno()).st_size - self.tell()
        return super().read(left if size is None else min(size, left))


def _opened_minc1(path: Path, *, is_packed: bool) -> Any:
    minc, netcdf = import_module("nibabel.minc1"), import_module("nibabel.externals.netcdf")
    file = open_gzipped(path) if is_packed else _BoundedReader(open_unbuffered(path))
    return minc.Minc1File(netcdf.netcdf_file(file, mmap=not is_packed))


def _opened_minc2(path: Path) -> Any:
    import h5py  # noqa: PLC0415 - an extra, which the reader has looked for

    file = h5py.File(path, "r", locking=False)
    for name in _minc2_names(file):
        # Links and external storage would read other files of this machine.
        is_link = not isinstance(file.get(name, getlink=True), h5py.HardLink)
        if is_link or (isinstance(found := file[name], h5py.Dataset) and (found.external or found.is_virtual)):
            raise _refusal(path, "it links to other files")
    return import_module("nibabel.minc2").Minc2File(file)


def _minc2_names(file: Any) -> Iterator[str]:
    folder = "minc-2.0/image/0"
    yield from ("minc-2.0", "minc-2.0/image", folder, "minc-2.0/dimensions")
    yield from (f"{folder}/{name}" for name in ("image", "image-max", "image-min"))
    yield from (f"minc-2.0/dimensions/{name}" for name in file["minc-2.0/dimensions"])


def _check_data(path: Path, file: Any, declared: int) -> None:
    """Refuse an image with missing voxels. Raises VP1008 or VP1304."""
    size = path.stat().st_size
    check_declared(path, declared, 0, 0, size * (MAX_DEFLATE_RATIO if _is_hdf5(file) or is_gzip(path) else 1))
    if not _is_hdf5(file):
        return
    dataset = file._image
    # HDF5 reads blocks that were never written as zeros.
    if dataset.chunks is None:
        missing, blocks = int(dataset.id.get_storage_size() < declared), 1
    else:
        blocks = prod(-(-n // chunk) for n, chunk in zip(dataset.shape, dataset.chunks, strict=True))
        missing = blocks - dataset.id.get_num_chunks()
    if missing:
        raise _refusal(path, f"{missing} of {blocks} blocks of its voxels are missing")


def _cosines(name: str, dim: Any) -> list[float]:
    default = [float(name == value) for value in ("xspace", "yspace", "zspace")]
    return [float(cosine) for cosine in np.reshape(getattr(dim, "direction_cosines", default), 3)]


def _text(value: object) -> str:
    text = value.decode("latin-1") if isinstance(value, bytes) else str(value)
    return text.strip("\0 ")[:_LONGEST_NAME]


def _is_odd(dim: Any, length: int) -> bool:
    is_regular = _text(getattr(dim, "spacing", b"regular__")) == "regular__"
    return not is_regular or int(getattr(dim, "length", length)) != length


def _scale(path: Path, file: Any, valid: NDArray[np.float64] | None) -> list[float] | None:
    """Return slope and intercept if all slices have the same; floats are physical values already. Raises VP1304."""
    if valid is None:
        return [1.0, 0.0]
    ends = [
        np.asarray(
            file._get_array(variable) if len(file._get_dimensions(variable)) else file._get_scalar(variable),
            dtype=np.float64,
        )
        for variable in (file._image_min, file._image_max)
    ]
    if not all(np.isfinite(end).all() and (end == end.flat[0]).all() for end in ends):
        return None
    low, high = (float(end.flat[0]) for end in ends)
    slope = (high - low) / float(valid[1] - valid[0])
    intercept = low - float(valid[0]) * slope
    if not np.isfinite([slope, intercept]).all():
        raise _refusal(path, f"its slices have values from {low:g} to {high:g}")
    return [slope, intercept] if slope else None


def _count_beyond(file: Any, dtype: np.dtype[Any], valid: NDArray[np.float64]) -> int:
    """Count voxels outside the valid range; a range of the whole type needs no look at the voxels."""
    ends = np.iinfo(dtype)
    if (valid == (ends.min, ends.max)).all():
        return 0
    data = _voxels(file)
    step = max(1, _SCANNED_VOXELS // max(prod(data.shape[1:]), 1))
    slabs = (np.asarray(data[start : start + step]).view(dtype) for start in range(0, data.shape[0], step))
    return sum(int(((slab < valid[0]) | (slab > valid[1])).sum()) for slab in slabs)


def _slab(file: Any, request: MincSlab) -> NDArray[np.generic]:
    names, first = list(file._dim_names), file._spatial_dims[0]
    sizes = dict(zip(names, file.get_data_shape(), strict=True))
    index: dict[str, int | slice] = {name: slice(None) for name in _SPATIAL}
    index[first] = slice(request.z0, request.z1)
    others = [name for name in names if name not in _SPATIAL]
    numbers = np.unravel_index(request.volume, [sizes[name] for name in others]) if others else ()
    index |= {name: int(number) for name, number in zip(others, numbers, strict=True)}
    place = tuple(index[name] for name in names)
    if request.scaled:
        return np.asarray(file.get_scaled_data(place)).astype(np.float32)
    dtype = np.dtype(file.get_data_dtype())
    data: NDArray[Any] = np.asarray(_voxels(file)[place]).view(dtype)
    if dtype.kind != "f":
        data = np.clip(data, *file._get_valid_range().astype(dtype))
    return data.astype(dtype.newbyteorder("="), copy=False)


def _voxels(file: Any) -> Any:
    """Return the stored voxels: an array of NetCDF, or a dataset of HDF5."""
    return file._image if _is_hdf5(file) else file._image.data


def _is_hdf5(file: Any) -> bool:
    return hasattr(file._image, "chunks")


def _refusal(path: Path, problem: str) -> VolprepError:
    return VolprepError("VP1304", path=path, problem=SafeText(problem))
