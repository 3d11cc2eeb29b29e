"""Levels of a package whose voxels are classified: colours and opacities in place of values.

Here the filter of a texture mixes premultiplied colour and opacity, so a level of values that was fitted for
interpolation before classification is wrong for it. Ways to make a level are compared by the light of random rays:

- box, or another filter of values: values are reduced, and classified then.
- transmittance: level 0 is classified, and what light does in the columns of each cell is averaged
  (`volprep/native/include/volprep/reductions.hpp`).
- least-squares: level 0 is classified, and each of the four channels fitted, so that the field between the voxels of
  the level misses it least.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.appearance import plain_look
from volprep.parts.levels.choose_level import CHECK_RAYS
from volprep.parts.levels.fitted import fitted_slabs
from volprep.parts.levels.level_input import LevelInput, level_slices, written
from volprep.parts.levels.light import rmse_of
from volprep.parts.levels.rays import random_lines, sample_level
from volprep.plan.level_choice import LevelChoice, Trial
from volprep.scan.slabs import RawVolume, slab_ranges
from volprep.transfer.preclassified import Voxels, medium_of_texels
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.package.channel import LevelFilter

Factors = tuple[int, int, int]

CLASSIFIED_CANDIDATES: tuple[LevelFilter, ...] = ("box", "transmittance", "least-squares")
"""Candidates of "auto"."""
_SEED = 3
_CODES = 256


@dataclass(frozen=True)
class _Channel(RawVolume):
    """One channel of what codes become."""

    by_code: UInt8Array

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        codes: NDArray[Any] = super().read_slab(z0, z1)
        channel: UInt8Array = self.by_code[codes]
        return channel


@dataclass(frozen=True)
class _ChannelOfTexels(RawVolume):
    """One channel of a level of texels, whose rows hold four bytes a voxel."""

    channel: int

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        shape = (self.shape_zyx[0], self.shape_zyx[1], 4 * self.shape_zyx[2])
        return np.ascontiguousarray(RawVolume(self.path, shape, self.dtype).read_slab(z0, z1)[..., self.channel :: 4])


class ClassifiedChooser:
    """Makes the levels of one volume of classified voxels."""

    def __init__(self, scan: LevelInput, voxels: Voxels) -> None:
        """Take the volume; `scan` has one lookup table, the transfer function's."""
        self._scan = scan
        self._voxels = voxels
        rays = min(CHECK_RAYS, 2 * max(scan.grid.shape_zyx) ** 2)
        self._lines = random_lines(scan.grid, rays, _SEED)
        ((_, table),) = scan.tables.items()
        self._truth = sample_level(scan.volume, scan.grid.spacing_mm_zyx, self._lines).light(table)

    def choose(
        self,
        level: int,
        factors: Factors,
        candidates: Sequence[LevelFilter],
        scratch: Callable[[str], Path],
        advance: Callable[[int], None],
    ) -> tuple[LevelChoice, RawVolume]:
        """Make a level in every way; give the choice, and its texels, four bytes a voxel, in a scratch file."""
        trials: list[Trial] = []
        made: list[RawVolume] = []
        z, y, x = (-(-n // f) for n, f in zip(self._scan.grid.shape_zyx, factors, strict=True))
        for name in candidates:
            began = time.perf_counter()
            slices = classified_slices(self._scan, self._voxels, name, factors)
            texels = written(slices, scratch(f"{level}-{name}.raw"), (z, y, 4 * x), advance)
            seconds = time.perf_counter() - began
            error = rmse_of(self._light(texels.path, (z, y, x), factors), self._truth)
            (transfer,) = self._scan.tables
            trials.append(Trial(filter=name, transfer=transfer, table="common", rmse=error, seconds=seconds))
            made.append(texels)
        best = min(range(len(trials)), key=lambda k: trials[k].rmse)
        for texels in made[:best] + made[best + 1 :]:
            texels.path.unlink()
        return LevelChoice(level=level, filter=trials[best].filter, trials=tuple(trials)), made[best]

    def _light(self, path: Path, shape_zyx: tuple[int, int, int], factors: Factors) -> Float64Array:
        """Light of the level as a shader draws it: the channels are sampled, and then become a medium."""
        z, y, x = (f * h for f, h in zip(factors, self._scan.grid.spacing_mm_zyx, strict=True))
        channels = [_ChannelOfTexels(path, shape_zyx, np.dtype(np.uint8), channel) for channel in range(4)]
        sampled = [sample_level(channel, (z, y, x), self._lines) for channel in channels]
        texels = np.stack([field.values * field.scale for field in sampled], axis=-1).astype(np.float64)
        colour, extinction = medium_of_texels(texels, self._voxels.reference_mm)
        firsts = sampled[0].offsets[:-1]
        counts = np.diff(sampled[0].offsets)
        depths = extinction * np.repeat(self._lines.lengths_mm / counts, counts)
        through = np.concatenate([[0.0], np.cumsum(depths)])
        before = np.repeat(through[firsts], counts)
        weights = np.exp(before - through[:-1]) - np.exp(before - through[1:])
        parts = np.column_stack([weights[:, None] * colour, weights])
        return np.asarray(np.add.reduceat(parts, firsts, axis=0))


def classified_slices(
    scan: LevelInput, voxels: Voxels, name: LevelFilter, factors: Factors
) -> Iterator[tuple[UInt8Array, int]]:
    """Return the slices of a level [z, y, 4 x], with the number of slices of level 0 that they cover."""
    if name == "transmittance":
        made = _transmitted(scan, voxels, factors)
    elif name == "least-squares":
        made = _fitted(scan.volume, voxels, factors)
    else:
        texels = voxels.texels(256**scan.volume.dtype.itemsize)
        made = ((texels[codes], read) for codes, read in level_slices(scan, name, factors))
    return ((value.reshape(*value.shape[:2], -1), read) for value, read in made)


def _transmitted(scan: LevelInput, voxels: Voxels, factors: Factors) -> Iterator[tuple[UInt8Array, int]]:
    volume = scan.volume
    by_code = voxels.straight(256**volume.dtype.itemsize)
    bytes_per_code = by_code[0].nbytes // volume.dtype.itemsize
    for z0, z1 in slab_ranges(volume.shape_zyx[0], volume.slice_bytes * bytes_per_code, multiple=factors[0]):
        codes: NDArray[Any] = volume.read_slab(z0, z1)
        level = np.empty((*_native.box_reduced_shape(codes.shape, factors), 4), np.float32)
        _native.rgba_reduce(by_code[codes], level, factors, scan.grid.spacing_mm_zyx, voxels.reference_mm)
        level[..., :3] *= level[..., 3:]
        yield np.rint(level * 255).astype(np.uint8), z1 - z0


def _fitted(volume: RawVolume, voxels: Voxels, factors: Factors) -> Iterator[tuple[UInt8Array, int]]:
    texels = voxels.texels(256**volume.dtype.itemsize)
    look = plain_look(_CODES, volume.shape_zyx)
    channels = [
        _Channel(volume.path, volume.shape_zyx, volume.dtype, np.ascontiguousarray(texels[:, channel]))
        for channel in range(4)
    ]
    for parts in zip(*(fitted_slabs(channel, factors, look) for channel in channels), strict=True):
        level = np.stack([slices for slices, _ in parts], axis=-1)
        # Each is fitted by itself; no colour is brighter than its opacity.
        yield np.minimum(level, level[..., 3:]), parts[0][1]
