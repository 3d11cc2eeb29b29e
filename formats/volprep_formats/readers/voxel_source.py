"""A source of voxels stored contiguously in a file, whatever the header format."""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import Grid
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress
from volprep_formats.readers.voxel_file import VoxelFile
from volprep_formats.source import ROUNDED, SourceInfo, StoredType

_KEPT: dict[str, StoredType] = {"uint8": "uint8", "int8": "int16", "int16": "int16", "uint16": "uint16"}
_SMALL: tuple[StoredType, ...] = ("uint8", "int16", "uint16")
_FLOAT32_EXACT = 2**24
_LEAST_STEPS = 256
"""Steps between the least and the greatest value; with fewer, rounding costs more than a package of 8 bits."""


class VoxelSource(OpenedSource):
    """One volume, read slab by slab.

    `most_bytes_after` is how much may follow it in a packed stream; if None, anything.
    """

    def __init__(self, info: SourceInfo, voxels: VoxelFile, *, most_bytes_after: int | None = 0) -> None:
        super().__init__(info, closing(voxels))
        self._voxels = voxels
        self._most_bytes_after = most_bytes_after

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x].

        Raises VolprepError VP1003, VP1005, VP1007 or VP1008 when the file is damaged, cut off or too long.
        """
        with np.errstate(over="ignore"):  # doubles beyond floats become infinite, and are refused as such later
            return self.read_unrounded(z0, z1).astype(self._info.stored_type, copy=False)

    def read_unrounded(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x], in the type of the file.

        Checks the bytes after the last one. Raises the errors of `read_slab`.
        """
        slab = read_voxels(self._voxels, z0, z1)
        is_last = z1 == self._voxels.shape_zyx[0]
        # A packed stream says only at its end whether its checksum is right.
        if is_last and self._voxels.is_packed and not self._voxels.at_end() and self._most_bytes_after is not None:
            actual = self._voxels.unpacked_bytes(2 * self._voxels.end_bytes)
            if actual > self._voxels.end_bytes + self._most_bytes_after:
                raise size_error(self._voxels, actual)
        return slab


@dataclass(frozen=True)
class HeaderFacts:
    """Volume properties from a header, for all formats."""

    format: str
    grid: Grid
    remarks: Sequence[str]
    slope: float = 1.0
    intercept: float = 0.0


def source_of(
    facts: HeaderFacts, voxels: VoxelFile, progress: Progress, *, most_bytes_after: int | None = 0
) -> VoxelSource:
    """Return the source of `voxels`, after finding the stored type and the loss of precision.

    Raises the errors of `find_stored_type`.
    """
    stored_type, lost = find_stored_type(voxels, progress)
    info = SourceInfo(
        format=facts.format,
        grid=facts.grid,
        stored_type=stored_type,
        slope=facts.slope,
        intercept=facts.intercept,
        remarks=(*facts.remarks, *lost),
    )
    return VoxelSource(info, voxels, most_bytes_after=most_bytes_after)


def check_declared(path: Path, voxel_bytes: int, offset_bytes: int, least: int, most: int) -> None:
    """Refuse a header whose voxels end before `least` or beyond `most`, the range that the file can hold.

    Call it before anything of that size is allocated. Raises VolprepError VP1008.
    """
    if not least <= offset_bytes + voxel_bytes <= most:
        actual = max((most if offset_bytes + voxel_bytes > most else least) - offset_bytes, 0)
        raise VolprepError("VP1008", path=path, expected=voxel_bytes, actual=actual)


def chosen_volume(path: Path, shape_zyx: tuple[int, int, int], volumes: int, wanted: int | None) -> int:
    """Return the 0-based number of the requested volume.

    Raises VP1021 if it does not exist, or if there are several and none was requested.
    """
    if not 1 <= (wanted or volumes) <= volumes or (wanted is None and volumes > 1):
        shape = "×".join(str(n) for n in (*reversed(shape_zyx), volumes))
        problem = SafeText("one volume is needed" if wanted is None else f"there is no volume {wanted}")
        raise VolprepError("VP1021", path=path, shape=shape, volumes=volumes, problem=problem)
    return (wanted or 1) - 1


def read_voxels(voxels: VoxelFile, z0: int, z1: int) -> NDArray[np.generic]:
    """Slices in the type of the file. Raises VolprepError VP1008 when it ends too early, and the errors of the file."""
    try:
        return voxels.read_slab(z0, z1)
    except EOFError as error:
        raise size_error(voxels, voxels.unpacked_bytes(voxels.end_bytes)) from error


def size_error(voxels: VoxelFile, actual: int) -> VolprepError:
    """Error for data that have `actual` bytes in all."""
    return VolprepError(
        "VP1008",
        path=voxels.path,
        expected=voxels.end_bytes - voxels.offset_bytes,
        actual=max(actual - voxels.offset_bytes, 0),
    )


def find_stored_type(voxels: VoxelFile, progress: Progress) -> tuple[StoredType, list[str]]:
    """Return the smallest type that holds the voxels, and the loss; wide integers are scanned for their range.

    If the voxels cannot be read, closes the file and raises the errors of `read_voxels`.
    """
    try:
        return stored_type_of(voxels.dtype.name, voxels.shape_zyx[0], lambda z: read_voxels(voxels, z, z + 1), progress)
    except VolprepError:
        voxels.close()
        raise


def stored_type_of(
    name: str, depth: int, read_slice: Callable[[int], NDArray[np.generic]], progress: Progress
) -> tuple[StoredType, list[str]]:
    """Return the smallest type that holds `depth` slices of numpy's type `name`, and the loss of precision."""
    if name in _KEPT:
        return _KEPT[name], []
    if name == "float64":
        return "float32", [
            "64-bit floating-point voxels are read as 32-bit ones" + _coarse_doubles(read_slice(depth // 2))
        ]
    if name in {"float16", "float32"}:
        return "float32", []
    progress.start(f"finding the range of {name} voxels", depth)
    ends: list[int] = []
    for z in range(depth):
        values: NDArray[Any] = read_slice(z)
        ends += [int(values.min()), int(values.max())]
        progress.advance()
    low, high = min(ends), max(ends)
    for kind in _SMALL:
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return kind, []
    if max(-low, high) <= _FLOAT32_EXACT:
        return "float32", []
    return "float32", [f"{ROUNDED}: {name} from {low} to {high}{_coarse(low, high)}"]


def _coarse_doubles(values: NDArray[Any]) -> str:
    """Describe the loss of a slice of doubles as floats, for people; empty if 8 bits would lose more."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return ""
    low, high = float(finite.min()), float(finite.max())
    said = _coarse(low, high)
    return f": {low:.10g} to {high:.10g} in the middle slice{said}" if said else ""


def _coarse(low: float, high: float) -> str:
    """Return the steps of 32-bit floats between two values, and what to do; nothing where 8 bits have larger ones."""
    largest, floats = max(abs(low), abs(high)), np.finfo(np.float32)
    if largest > float(floats.max) or 0 < largest < _LEAST_STEPS * float(floats.smallest_normal):
        return ", which they do not hold; multiply the values in the source by a factor"
    step = float(np.spacing(np.float32(largest)))
    if not 0 < high - low < _LEAST_STEPS * step:
        return ""
    return f", in steps of {step:g}; subtract an offset from the values in the source, such as {low:.10g}"
