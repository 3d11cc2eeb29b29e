"""MINC volumes (.mnc, .mnc.gz), from RAS to LPS: MINC 1 is NetCDF, MINC 2 is HDF5 and needs h5py.

Source: the MINC 1 programmer's guide and the MINC 2.0 file format reference (https://en.wikibooks.org/wiki/MINC). Each
slice may map integers to a range of physical values of its own: integers are kept as stored if all ranges are the same,
and read as floats otherwise. Attributes of patient, study and acquisition are not read.
"""

import itertools
import json
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from math import prod
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.installation import how_to_add
from volprep_formats.isolation import Function, WorkerRequest, Workers, workers
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.minc.file import HDF5, MincFacts, MincFile, MincSlab, facts_of, read_slab
from volprep_formats.readers.orientation import LPS_FROM_RAS, ORIENTATION_TOLERANCE
from volprep_formats.readers.time_axis import TimeAxis, seconds_per
from volprep_formats.readers.voxel_source import chosen_volume, stored_type_of
from volprep_formats.regular_files import is_gzip, open_regular
from volprep_formats.source import SourceInfo, SourceSpec

_MM_PER_UNIT = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3}
_LARGEST_HEADER = 2**16
_BASE_MEMORY_BYTES = 2**29
_PACKED_MEMORY_PER_BYTE, _PLAIN_MEMORY_PER_BYTE = 64, 2
"""nibabel unpacks all variables of a gzipped file; a plain one is mapped."""
_SLAB_VOXELS, _MEMORY_PER_VOXEL = 2**24, 32
_SECONDS, _BYTES_PER_SECOND = 30.0, 2**20
_tokens = itertools.count()


@dataclass(frozen=True)
class _File:
    """Worker processes that read one file."""

    pool: Workers
    request: MincFile
    file_bytes: int
    is_packed: bool

    def run(self, function: Function, argument: object, result_bytes: int, voxels: int) -> NDArray[np.generic]:
        """Call a function of `file`; the result is a copy."""
        per_byte = _PACKED_MEMORY_PER_BYTE if self.is_packed else _PLAIN_MEMORY_PER_BYTE
        request = WorkerRequest(
            function=function,
            argument=argument,
            path=self.request.path,
            result_bytes=result_bytes,
            memory_bytes=_BASE_MEMORY_BYTES + per_byte * self.file_bytes + _MEMORY_PER_VOXEL * voxels,
            seconds=_SECONDS + self.file_bytes / _BYTES_PER_SECOND,
        )
        return self.pool.result_of(request)


class MincSource(OpenedSource):
    """One volume of a MINC file, which a worker process holds open."""

    def __init__(self, info: SourceInfo, slices: "_Slices", opened: ExitStack) -> None:
        super().__init__(info, opened)
        self._slices = slices

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x]. Raises VolprepError VP1304 or VP1270 to VP1273."""
        slab = np.empty((z1 - z0, *self._info.grid.shape_zyx[1:]), dtype=self._info.stored_type)
        with np.errstate(over="ignore"):  # doubles beyond floats become infinite, and are refused as such later
            for start, part in self._parts(z0, z1):
                slab[start - z0 : start - z0 + len(part)] = part
        return slab

    def read_unrounded(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Values of slices z0 to z1 - 1 as [z, y, x], in the type of the file. Raises the errors of `read_slab`."""
        return np.concatenate([part for _, part in self._parts(z0, z1)])

    def _parts(self, z0: int, z1: int) -> Iterator[tuple[int, NDArray[np.generic]]]:
        """Give the slices in pieces that a worker can return, each with the number of its first slice."""
        step = max(1, _SLAB_VOXELS // prod(self._info.grid.shape_zyx[1:]))
        for start in range(z0, z1, step):
            yield start, self._slices.read(start, min(start + step, z1))


@dataclass(frozen=True)
class _Slices:
    """Slices of one volume, as stored or scaled."""

    file: _File
    volume: int
    shape_zyx: tuple[int, int, int]
    dtype: np.dtype[np.generic]
    scaled: bool

    def read(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Return slices z0 to z1 - 1."""
        voxels = (z1 - z0) * self.shape_zyx[1] * self.shape_zyx[2]
        request = MincSlab(self.file.request, self.volume, z0, z1, self.scaled)
        return self.file.run(read_slab, request, voxels * self.dtype.itemsize, voxels)


def time_axis(_spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the axis of time. Raises what `open_volume` raises."""
    with ExitStack() as opened:
        _, facts = _opened(path, opened)
    step, start, unit = facts.time
    return TimeAxis.even(facts.volumes, step, seconds_per(unit), start)


def _opened(path: Path, opened: ExitStack) -> tuple[_File, MincFacts]:
    """Return a file that is open until `opened` ends, and the facts from its header."""
    with open_regular(path) as head:
        is_hdf5 = head.read(len(HDF5)) == HDF5
    if is_hdf5 and find_spec("h5py") is None:
        raise VolprepError("VP1305", path=path, how=how_to_add("minc"))
    request = MincFile(path, next(_tokens))
    file = _File(opened.enter_context(workers()), request, path.stat().st_size, is_gzip(path))
    return file, MincFacts(**json.loads(file.run(facts_of, request, _LARGEST_HEADER, 0).tobytes()))


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> MincSource:
    """Open one volume of numbers: of several, that which `spec.volume` numbers.

    Raises VolprepError VP1003, VP1008, VP1021, VP1270 to VP1273, VP1304, VP1305 (h5py is missing), VP2020 (sheared) or
    VP2021 (unusable axes).
    """
    with ExitStack() as opened:
        file, facts = _opened(path, opened)
        nz, ny, nx = facts.shape_zyx
        volume = chosen_volume(path, (nz, ny, nx), facts.volumes, spec.volume)
        grid = _grid(path, facts)
        dtype = np.dtype(facts.dtype if facts.scale else "float32")
        slices = _Slices(file, volume, (nz, ny, nx), dtype, facts.scale is None)
        stored_type, lost = stored_type_of(dtype.name, nz, lambda z: slices.read(z, z + 1), progress)
        slope, intercept = facts.scale or (1.0, 0.0)
        remarks = (*_remarks(facts), *lost)
        info = SourceInfo(
            format="minc", grid=grid, stored_type=stored_type, slope=slope, intercept=intercept, remarks=remarks
        )
        return MincSource(info, slices, opened.pop_all())


def _grid(path: Path, facts: MincFacts) -> Grid:
    """Grid in LPS millimetres. Raises VP2020 or VP2021."""
    if not {*facts.units} <= _MM_PER_UNIT.keys() or len({*facts.units}) > 1:
        raise VolprepError("VP2021", path=path, which="unit of length")
    cosines = np.array(facts.cosines, dtype=np.float64)
    with np.errstate(all="ignore"):  # non-finite values are refused below
        if not (np.abs(np.linalg.norm(cosines, axis=1) - 1.0) <= ORIENTATION_TOLERANCE).all():
            raise VolprepError("VP2021", path=path, which="field direction_cosines")
        to_mm = LPS_FROM_RAS * _MM_PER_UNIT[facts.units[0]]
        # The file lists axes from the slowest one, the grid from x, the fastest.
        columns = (to_mm * cosines * np.array(facts.steps)[:, None])[::-1].T
        origin = to_mm * np.array(facts.origin)
    nz, ny, nx = facts.shape_zyx
    return grid_from_affine(path, "field step or start", (nz, ny, nx), columns, origin)


def _remarks(facts: MincFacts) -> Iterator[str]:
    if facts.scale is None:
        yield "each slice has a range of values of its own; physical values are read as 32-bit floating point"
    if facts.beyond and facts.valid:
        low, high = facts.valid
        yield f"{facts.beyond} voxels lie outside the valid range {low:g} to {high:g}, and are set to its nearer end"
    if facts.odd_axes:
        axes = ", ".join(facts.odd_axes)
        yield f"spacing or length of {axes} contradicts the image; regular slices and the size of the image are taken"
