"""Levels fitted to level 0: the field between their voxels, which a renderer samples, has the least error.

- least-squares: in the values. The projection of level 0 onto what trilinear interpolation can say. A box filter's
  level is interpolated, and so smoothed, once more; this one has that taken out.
- appearance: in what the scene's transfer functions make of the values, weighted by how much each part is seen
  (volprep.parts.levels.look). A level for these transfer functions: what they show alike may be mixed up.

Both are volprep's own. They begin with the mean of each cell, and improve it by Gauss-Newton steps that take the sums
of rows for the matrix; of values alone, these steps need level 0 only once, of looks each takes half of its rows, in
turn (light along rays is as near as with all of them: within 1.8 %, on average within 0.2 %). At last each voxel is
brought into the range of its cell: what nothing there has would be invented, and where noise is strong it shows (a
head at half resolution: 47 % nearer than box with it, 44 % without).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.look import Look, largest_code, write_means
from volprep.scan.slabs import RawVolume, slab_ranges
from volprep_formats.arrays import Float32Array

Factors = tuple[int, int, int]

_ITERATIONS = 4
"""A voxel sees what lies so many voxels of its level away; with more of them pictures come no nearer. With three of any
size light along rays is up to 2.5 % further away; from a level fitted to values, which overshoots where a transfer
function is steep, two or three end 5 to 10 % further away."""
_STEP = 1.2
"""Between plain steps and those that begin to overshoot where a transfer function is steep."""
_SAMPLES = 4
"""Along each axis of a voxel of the level. Where it stands for more voxels of level 0, means of these are samples: less
work for each level below the second, and light as near (a head at an eighth: within 0.7 %; with two samples, 4 %)."""


def fitted_slabs(volume: RawVolume, factors_zyx: Factors, look: Look) -> Iterator[tuple[NDArray[Any], int]]:
    """Return the slices of the level in order, some at a time, with the number of slices of level 0 they stand for.

    The bytes do not depend on the slabs: each reaches as far beyond what it gives as the iterations carry. Memory holds
    such a slab.
    """
    z, y, x = (max(1, factor // _SAMPLES) for factor in factors_zyx)
    return (
        _to_voxels(volume, factors_zyx, look) if z == y == x == 1 else _to_means(volume, factors_zyx, (z, y, x), look)
    )


def _to_voxels(volume: RawVolume, factors_zyx: Factors, look: Look) -> Iterator[tuple[NDArray[Any], int]]:
    depth = volume.shape_zyx[0]
    reach = _ITERATIONS * factors_zyx[0]
    # Thin slabs would be mostly reach: these are twice as thick as others.
    slabs = list(slab_ranges(depth, -(-volume.slice_bytes // 2), multiple=factors_zyx[0]))
    bins_per_code = 1.0 if look.is_plain else _bins_per_code(look, volume.dtype)
    for z0, z1 in _joined(slabs, 2 * reach):
        first, stop = max(z0 - reach, 0), min(z1 + reach, depth)
        slab: NDArray[Any] = volume.read_slab(first, stop)
        cells = _Cells.of(slab, factors_zyx, bins_per_code)
        begin = (z0 - first) // factors_zyx[0]
        end = begin - (-(z1 - z0) // factors_zyx[0])
        if look.is_plain:
            _native.fit_values(slab, cells.level, factors_zyx, largest_code(volume.dtype), _ITERATIONS, _STEP)
        else:
            _native.fit_level(
                slab,
                cells.level,
                factors_zyx,
                first,
                (begin, end),
                bins_per_code,
                look.linear,
                look.table,
                look.weights,
                look.block_zyx,
                _ITERATIONS,
                _STEP,
            )
        yield cells[begin:end].codes(bins_per_code), z1 - z0


def _to_means(
    volume: RawVolume, factors_zyx: Factors, mean_of_zyx: Factors, look: Look
) -> Iterator[tuple[NDArray[Any], int]]:
    z, y, x = (f // n for f, n in zip(factors_zyx, mean_of_zyx, strict=True))
    block = tuple(edge // n for edge, n in zip(look.block_zyx, mean_of_zyx, strict=True))
    depth = volume.shape_zyx[0]
    # As thin as the iterations reach: three of them are in memory.
    ranges = slab_ranges(depth, 1, _ITERATIONS * factors_zyx[0], slab_bytes=1)
    room = _Room(volume, factors_zyx, mean_of_zyx, look)
    first = 0
    for window, wanted in _windows(volume, ranges, room):
        level = window.cells.level.copy()
        if look.is_plain:
            _native.fit_values(window.values, level, (z, y, x), look.bins - 1, _ITERATIONS, _STEP)
        else:
            _native.fit_level_to_means(
                window.values,
                window.looks,
                level,
                (z, y, x),
                (first - wanted.start) * z,
                (wanted.start, wanted.stop),
                look.linear,
                look.table,
                look.weights,
                block,
                _ITERATIONS,
                _STEP,
            )
        cells = _Cells(level, window.cells.low, window.cells.high)[wanted]
        yield (
            cells.codes(_bins_per_code(look, volume.dtype)),
            min((wanted.stop - wanted.start) * factors_zyx[0], depth - first * factors_zyx[0]),
        )
        first += wanted.stop - wanted.start


@dataclass(frozen=True)
class _Cells:
    """The cells of some slices of a level: where their fit begins, and between which codes it ends."""

    level: Float32Array
    low: NDArray[Any]
    high: NDArray[Any]

    @classmethod
    def empty(cls, shape_zyx: Factors, dtype: np.dtype[np.generic]) -> Self:
        low, high = (np.empty(shape_zyx, dtype) for _ in range(2))
        return cls(np.empty(shape_zyx, np.float32), low, high)

    @classmethod
    def of(cls, slab: NDArray[Any], factors_zyx: Factors, bins_per_code: float) -> Self:
        cells = cls.empty(_native.box_reduced_shape(slab.shape, factors_zyx), slab.dtype)
        cells.fill(slab, factors_zyx, bins_per_code)
        return cells

    def fill(self, slab: NDArray[Any], factors_zyx: Factors, bins_per_code: float) -> None:
        """Write what the cells of a slab are."""
        # Not yet in use.
        means = self.low
        _native.box_reduce(slab, means, factors_zyx)
        np.multiply(means, np.float32(bins_per_code), out=self.level, dtype=np.float32)
        _native.extrema_reduce(slab, self.low, self.high, factors_zyx)

    def codes(self, bins_per_code: float) -> NDArray[Any]:
        """Return the codes of the level, in whose memory it becomes them."""
        self.level[...] /= np.float32(bins_per_code)
        codes: NDArray[Any] = np.rint(self.level, out=self.level).astype(self.low.dtype)
        np.clip(codes, self.low, self.high, out=codes)
        return codes

    def __getitem__(self, part: slice) -> "_Cells":
        return _Cells(self.level[part], self.low[part], self.high[part])


@dataclass(frozen=True)
class _Strip:
    """Some slices of a level, and the means that they are fitted to."""

    values: Float32Array
    looks: Float32Array
    cells: _Cells


def _windows(volume: RawVolume, ranges: Iterable[tuple[int, int]], room: "_Room") -> Iterator[tuple[_Strip, slice]]:
    """Return strips with those before and after them, and which cells they are. They share one memory."""
    given = 0
    for z0, z1 in ranges:
        if room.filled == 3 * room.size:
            room.drop_first()
            given -= room.size
        # A strip of a level far down is many slices of level 0.
        for first, stop in slab_ranges(z1 - z0, volume.slice_bytes, multiple=room.cell_slices):
            room.append(volume.read_slab(z0 + first, z0 + stop))
        if room.filled == given + 2 * room.size:
            yield room.window(), slice(given, given + room.size)
            given += room.size
    yield room.window(), slice(given, room.filled)


class _Room:
    """Memory for three strips that follow each other, each of as many cells as the iterations carry."""

    size = _ITERATIONS
    """Slices of the level in a strip; the last one of a volume may have fewer."""

    def __init__(self, volume: RawVolume, factors_zyx: Factors, mean_of_zyx: Factors, look: Look) -> None:
        depth = 3 * self.size * factors_zyx[0]
        shape = (depth, *volume.shape_zyx[1:])
        z, y, x = _native.box_reduced_shape(shape, mean_of_zyx)
        self._factors_zyx = factors_zyx
        self._mean_of_zyx = mean_of_zyx
        self._look = look
        self._samples_per_cell = factors_zyx[0] // mean_of_zyx[0]
        self._values = np.empty((z, y, x), np.float32)
        self._looks = np.empty((z, len(look.table), y, x, look.table.shape[2]), np.float32)
        self._cells = _Cells.empty(_native.box_reduced_shape(shape, factors_zyx), volume.dtype)
        self._samples = 0
        self.filled = 0

    @property
    def cell_slices(self) -> int:
        """Slices of level 0 for one of the level."""
        return self._factors_zyx[0]

    def append(self, slab: NDArray[Any]) -> None:
        """Add the next slices of level 0: whole cells, but for the last of a volume."""
        samples = slice(self._samples, self._samples + -(-len(slab) // self._mean_of_zyx[0]))
        cells = slice(self.filled, self.filled + -(-len(slab) // self._factors_zyx[0]))
        write_means(slab, self._mean_of_zyx, self._look.table, self._values[samples], self._looks[samples])
        self._cells[cells].fill(slab, self._factors_zyx, _bins_per_code(self._look, slab.dtype))
        self._samples, self.filled = samples.stop, cells.stop

    def drop_first(self) -> None:
        """Make room for another strip."""
        cells = self._cells
        for room in (self._values, self._looks, cells.level, cells.low, cells.high):
            strip = len(room) // 3
            # Two copies, so that neither needs memory of its own.
            room[:strip] = room[strip : 2 * strip]
            room[strip : 2 * strip] = room[2 * strip :]
        self._samples -= self.size * self._samples_per_cell
        self.filled -= self.size

    def window(self) -> _Strip:
        """Return what is there."""
        return _Strip(self._values[: self._samples], self._looks[: self._samples], self._cells[: self.filled])


def _bins_per_code(look: Look, dtype: np.dtype[np.generic]) -> float:
    return (look.bins - 1) / largest_code(dtype)


def _joined(ranges: list[tuple[int, int]], thinnest: int) -> Iterator[tuple[int, int]]:
    """Join neighbouring ranges until each holds at least `thinnest` slices; the last may hold fewer."""
    begin = 0
    for _, end in ranges:
        if end - begin >= thinnest or end == ranges[-1][1]:
            yield begin, end
            begin = end
