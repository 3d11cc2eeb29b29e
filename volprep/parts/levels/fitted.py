"""Levels fitted to level 0: the field between their voxels, which a renderer samples, has the least error.

- least-squares: in the values. The projection of level 0 onto what trilinear interpolation can say. A box filter's
  level is interpolated, and so smoothed, once more; this one has that taken out.
- appearance: in what the scene's transfer functions make of the values, weighted by how much each part is seen
  (volprep.parts.levels.look). A level for these transfer functions: what they show alike may be mixed up.

Both are volprep's own. They begin with the mean of each cell, and improve it by Gauss-Newton steps that take the sums
of rows for the matrix; of values alone, these steps need level 0 only once, of looks each takes half of its rows, in
turn (light along rays is as near as with all of them: within 1.2 %, on average within 0.2 %). At last each voxel is
brought into the range of its cell: what nothing there has would be invented, and where noise is strong it shows (a
head at half resolution: 47 % nearer than box with it, 44 % without).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.look import Look, largest_code, sample_means
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
    strips = (_Strip.of(volume, each, factors_zyx, mean_of_zyx, look) for each in ranges)
    first = 0
    for window, wanted in _windows(strips, z):
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
    def of(cls, slab: NDArray[Any], factors_zyx: Factors, bins_per_code: float) -> Self:
        means, low, high = (np.empty(_native.box_reduced_shape(slab.shape, factors_zyx), slab.dtype) for _ in range(3))
        _native.box_reduce(slab, means, factors_zyx)
        _native.extrema_reduce(slab, low, high, factors_zyx)
        return cls(means.astype(np.float32) * np.float32(bins_per_code), low, high)

    def codes(self, bins_per_code: float) -> NDArray[Any]:
        codes: NDArray[Any] = np.rint(self.level / np.float32(bins_per_code)).astype(self.low.dtype)
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

    @classmethod
    def of(
        cls, volume: RawVolume, part: tuple[int, int], factors_zyx: Factors, mean_of_zyx: Factors, look: Look
    ) -> Self:
        slab: NDArray[Any] = volume.read_slab(*part)
        return cls(
            *sample_means(slab, mean_of_zyx, look.table), _Cells.of(slab, factors_zyx, _bins_per_code(look, slab.dtype))
        )


def _windows(strips: Iterator[_Strip], samples: int) -> Iterator[tuple[_Strip, slice]]:
    """Return strips with those before and after them, and which cells they are. They share one memory.

    A cell has so many slices of `samples`; the last one of a volume may have fewer.
    """
    strip = next(strips)
    size = len(strip.cells.level)
    room = _Room(strip, size, samples)
    del strip
    given = 0
    for strip in strips:
        if room.filled == 3 * size:
            room.drop_first()
            given -= size
        room.append(strip)
        # Before the next one is made.
        del strip
        if room.filled == given + 2 * size:
            yield room.window(), slice(given, given + size)
            given += size
    yield room.window(), slice(given, room.filled)


class _Room:
    """Memory for three strips that follow each other."""

    def __init__(self, strip: _Strip, size: int, samples: int) -> None:
        self._size = size
        self._samples = samples
        self._arrays = [np.empty((3 * size * per, *each.shape[1:]), each.dtype) for each, per in self._parts(strip)]
        self._missing = 0
        self.filled = 0
        self.append(strip)

    def append(self, strip: _Strip) -> None:
        for room, (array, per) in zip(self._arrays, self._parts(strip), strict=True):
            room[self.filled * per : self.filled * per + len(array)] = array
        self.filled += len(strip.cells.level)
        self._missing = len(strip.cells.level) * self._samples - len(strip.values)

    def drop_first(self) -> None:
        for room in self._arrays:
            strip = len(room) // 3
            # Two copies, so that neither needs memory of its own.
            room[:strip] = room[strip : 2 * strip]
            room[strip : 2 * strip] = room[2 * strip :]
        self.filled -= self._size

    def window(self) -> _Strip:
        samples = self.filled * self._samples - self._missing
        values, looks, level, low, high = self._arrays
        cells = _Cells(level[: self.filled], low[: self.filled], high[: self.filled])
        return _Strip(values[:samples], looks[:samples], cells)

    def _parts(self, strip: _Strip) -> list[tuple[NDArray[Any], int]]:
        """Arrays, with how many of their slices a cell has."""
        cells = strip.cells
        return [
            (strip.values, self._samples),
            (strip.looks, self._samples),
            *((each, 1) for each in (cells.level, cells.low, cells.high)),
        ]


def _bins_per_code(look: Look, dtype: np.dtype[np.generic]) -> float:
    return (look.bins - 1) / largest_code(dtype)


def _joined(ranges: list[tuple[int, int]], thinnest: int) -> Iterator[tuple[int, int]]:
    """Join neighbouring ranges until each holds at least `thinnest` slices; the last may hold fewer."""
    begin = 0
    for _, end in ranges:
        if end - begin >= thinnest or end == ranges[-1][1]:
            yield begin, end
            begin = end
