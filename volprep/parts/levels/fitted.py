"""Levels fitted to level 0: the field between their voxels, which a renderer samples, has the least error.

- least-squares: in the values. The projection of level 0 onto what trilinear interpolation can say. A box filter's
  level is interpolated, and so smoothed, once more; this one has that taken out.
- appearance: in what the scene's transfer functions make of the values, weighted by how much each part is seen
  (volprep.parts.levels.appearance). The level suits these transfer functions: values that they show in the same way
  may be mixed up.

Both are volprep's own. They begin with the mean of each cell, and improve it by Gauss-Newton steps that take the sums
of rows for the matrix; of values alone, these steps need level 0 only once, of looks each takes half of its rows, in
turn (light along rays is as near as with all of them: within 1.8 %, on average within 0.2 %). At last each voxel is
brought into the range of its cell: what nothing there has would be invented, and where noise is strong it shows (a
head at half resolution: 47 % nearer than box with it, 44 % without).
"""

from collections.abc import Iterable, Iterator
from typing import Any

from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.appearance import Look, largest_code
from volprep.parts.levels.means import Cells, Means, MeansOfVoxels, Strip, bins_per_code, edges_of_means
from volprep.scan.slabs import RawVolume, slab_ranges

Factors = tuple[int, int, int]

_ITERATIONS = 4
"""Number of iterations: a voxel is influenced by voxels of its level up to this far away, and more iterations bring
pictures no closer. With three of any size light along rays is up to 2.5 % further away; from a level fitted to values,
which overshoots where a transfer function is steep, two or three end 5 to 10 % further away."""
_STEP = 1.2
"""Step size, between plain steps and steps that begin to overshoot where a transfer function is steep."""


def fitted_slabs(
    volume: RawVolume, factors_zyx: Factors, look: Look, means: Means | None = None
) -> Iterator[tuple[NDArray[Any], int]]:
    """Return the slices of the level in order, a few at a time, with the number of slices of level 0 that they cover.

    The bytes do not depend on the slabs: each slab is extended by the reach of the iterations. Memory holds such a
    slab. Level 0 is not read where the level's `means` are given.
    """
    if edges_of_means(factors_zyx) == (1, 1, 1):
        return _to_voxels(volume, factors_zyx, look)
    return _to_means(volume, factors_zyx, look, means or MeansOfVoxels(volume, factors_zyx, look))


def _to_voxels(volume: RawVolume, factors_zyx: Factors, look: Look) -> Iterator[tuple[NDArray[Any], int]]:
    depth = volume.shape_zyx[0]
    reach = _ITERATIONS * factors_zyx[0]
    # Thin slabs would be mostly reach: these are twice as thick as others.
    slabs = list(slab_ranges(depth, -(-volume.slice_bytes // 2), multiple=factors_zyx[0]))
    bins = 1.0 if look.is_plain else bins_per_code(look, volume.dtype)
    for z0, z1 in _joined(slabs, 2 * reach):
        first, stop = max(z0 - reach, 0), min(z1 + reach, depth)
        slab: NDArray[Any] = volume.read_slab(first, stop)
        cells = Cells.of(slab, factors_zyx)
        level = cells.begin(bins)
        begin = (z0 - first) // factors_zyx[0]
        end = begin - (-(z1 - z0) // factors_zyx[0])
        if look.is_plain:
            _native.fit_values(slab, level, factors_zyx, largest_code(volume.dtype), _ITERATIONS, _STEP)
        else:
            _native.fit_level(
                slab,
                level,
                factors_zyx,
                first,
                (begin, end),
                bins,
                look.linear,
                look.table,
                look.weights,
                look.block_zyx,
                _ITERATIONS,
                _STEP,
            )
        yield cells[begin:end].codes(level[begin:end], bins), z1 - z0


def _to_means(volume: RawVolume, factors_zyx: Factors, look: Look, means: Means) -> Iterator[tuple[NDArray[Any], int]]:
    edges = edges_of_means(factors_zyx)
    z, y, x = (f // n for f, n in zip(factors_zyx, edges, strict=True))
    block = tuple(edge // n for edge, n in zip(look.block_zyx, edges, strict=True))
    depth = volume.shape_zyx[0]
    room = _Room(volume, factors_zyx, look)
    bins = bins_per_code(look, volume.dtype)
    # As thin as the iterations reach: three of them are in memory.
    strips = slab_ranges(-(-depth // factors_zyx[0]), 1, _ITERATIONS, slab_bytes=1)
    first = 0
    for window, wanted in _windows(means, strips, room):
        level = window.cells.begin(bins)
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
        slices = wanted.stop - wanted.start
        yield (
            window.cells[wanted].codes(level[wanted], bins),
            min(slices * factors_zyx[0], depth - first * factors_zyx[0]),
        )
        first += slices


def _windows(means: Means, strips: Iterable[tuple[int, int]], room: "_Room") -> Iterator[tuple[Strip, slice]]:
    """Return strips with those before and after them, and which of their cells they are. They share one memory."""
    given = 0
    for begin, end in strips:
        if room.filled == 3 * room.size:
            room.drop_first()
            given -= room.size
        means.read(begin, room.next(end - begin))
        if room.filled == given + 2 * room.size:
            yield room.window(), slice(given, given + room.size)
            given += room.size
    yield room.window(), slice(given, room.filled)


class _Room:
    """Memory for three successive strips, each one cell deep for each iteration."""

    size = _ITERATIONS
    """Slices of the level in a strip; the last one of a volume may have fewer."""

    def __init__(self, volume: RawVolume, factors_zyx: Factors, look: Look) -> None:
        self._factor, self._edge = factors_zyx[0], edges_of_means(factors_zyx)[0]
        shape = (3 * self.size * self._factor, *volume.shape_zyx[1:])
        self._strips = Strip.empty(shape, factors_zyx, look, volume.dtype)
        self._left = volume.shape_zyx[0]
        self._samples = 0
        self.filled = 0

    def next(self, cells: int) -> Strip:
        """Return the place of the next slices of cells, which counts as filled."""
        slices = min(cells * self._factor, self._left)
        begin, first = self._samples, self.filled
        self._left -= slices
        self._samples -= -slices // self._edge
        self.filled += cells
        return self._strips.part(slice(begin, self._samples), slice(first, self.filled))

    def drop_first(self) -> None:
        """Make room for another strip."""
        for room in self._strips.arrays:
            strip = len(room) // 3
            # Two copies, so that neither needs memory of its own.
            room[:strip] = room[strip : 2 * strip]
            room[strip : 2 * strip] = room[2 * strip :]
        self._samples -= self.size * self._factor // self._edge
        self.filled -= self.size

    def window(self) -> Strip:
        """Return the next slices."""
        return self._strips.part(slice(self._samples), slice(self.filled))


def _joined(ranges: list[tuple[int, int]], thinnest: int) -> Iterator[tuple[int, int]]:
    """Join neighbouring ranges until each holds at least `thinnest` slices; the last may hold fewer."""
    begin = 0
    for _, end in ranges:
        if end - begin >= thinnest or end == ranges[-1][1]:
            yield begin, end
            begin = end
