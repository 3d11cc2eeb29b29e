"""Scans whose slices form no grid, made into volumes on request: uneven gaps resampled, gantry tilt sheared away.

Slices stay whole and parallel: each is moved sideways by linear interpolation within it (tilt), and new ones are made
by linear interpolation between neighbours (gaps). The plane grows so that nothing is cut off; what no slice covers gets
the lowest value of the scan. Integers are rounded to the nearest. The repairs are listed in `SourceInfo.repairs`.
"""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.scan.slabs import slab_ranges
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress
from volprep_formats.readers import open_slices, open_source
from volprep_formats.repairs import GapRepair, TiltRepair
from volprep_formats.source import SourceSpec, VolumeSource
from volprep_formats.uneven_source import UnevenSource

_MOST_GROWTH = 4
"""A repair that makes more than this many times the slices, rows or columns invents more than it reads."""
_STRAIGHT_PIXELS = 0.1
"""Slices that shift by less than this in all are taken as straight along that axis."""


def open_scan(spec: SourceSpec, base: Path, progress: Progress) -> VolumeSource:
    """Open the source that `spec` describes, with the repairs that it allows; a relative path starts at `base`.

    Raises the errors of `open_source`, and VP2016 for slices that no repair makes a volume of.
    """
    if not spec.repair:
        return open_source(spec, base, progress)
    source = open_slices(spec, base, progress)
    return RepairedSource(source, progress) if isinstance(source, UnevenSource) else source


class RepairedSource(OpenedSource):
    """A source on an even grid, whose slabs are interpolated from uneven slices."""

    def __init__(self, source: UnevenSource, progress: Progress) -> None:
        """Find the grid, and the lowest value where it is needed: that takes one reading of the scan."""
        self._source = source.slices
        nominal = source.nominal
        places = source.places
        depth, rows, columns = nominal.grid.shape_zyx
        spacing_mm_yx = nominal.grid.spacing_mm_zyx[1:]
        self._between, pitch_mm, gaps = _even_places(source)
        self._beside_yx = _shifts(source)
        start_yx = np.floor(self._beside_yx.min(axis=0)).astype(int)
        self._beside_yx -= start_yx
        grown_yx = np.ceil(self._beside_yx.max(axis=0)).astype(int)
        shape_yx = (rows + int(grown_yx[0]), columns + int(grown_yx[1]))
        if max(len(self._between) / depth, shape_yx[0] / rows, shape_yx[1] / columns) > _MOST_GROWTH:
            size = "×".join(str(n) for n in (shape_yx[1], shape_yx[0], len(self._between)))
            raise VolprepError("VP2016", path=source.places.folder, size=size, growth=_MOST_GROWTH)
        repairs: list[GapRepair | TiltRepair] = [] if gaps is None else [gaps]
        self._padding = 0.0
        if grown_yx.any():
            self._padding = _lowest(source, progress)
            repairs.append(
                TiltRepair(
                    about_rows_deg=_angle_deg([b[1] for b in places.beside_mm_xy], places.along_mm),
                    about_columns_deg=_angle_deg([b[0] for b in places.beside_mm_xy], places.along_mm),
                    added_rows=int(grown_yx[0]),
                    added_columns=int(grown_yx[1]),
                    padding=nominal.slope * self._padding + nominal.intercept,
                )
            )
        start_mm_xyz = [start_yx[1] * spacing_mm_yx[1], start_yx[0] * spacing_mm_yx[0], 0.0]
        origin = np.array(nominal.grid.origin_mm_xyz) + np.array(nominal.grid.direction) @ start_mm_xyz
        grid = Grid.of((len(self._between), *shape_yx), (pitch_mm, *spacing_mm_yx), origin, nominal.grid.direction)
        super().__init__(nominal.model_copy(update={"grid": grid, "repairs": tuple(repairs)}), source)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x]. Raises the errors of the reader."""
        between = self._between[z0:z1]
        slab = np.empty((len(between), *self._info.grid.shape_zyx[1:]), dtype=self._info.stored_type)
        if not len(between):
            return slab
        first, last = int(between[0]), int(np.ceil(between[-1]))
        moved = self._mover(first, self._source.read_slab(first, last + 1))
        for place, target in zip(between, slab, strict=True):
            below = int(place)
            weight = place - below
            values = moved(below) if weight == 0.0 else (1 - weight) * moved(below) + weight * moved(below + 1)
            target[...] = values if slab.dtype.kind == "f" else np.rint(values)
        return slab

    def _mover(self, first: int, slices: NDArray[np.generic]) -> Callable[[int], Float64Array]:
        """Return the function that moves slice z sideways to where it belongs; it remembers two neighbours."""

        @lru_cache(maxsize=2)
        def moved(z: int) -> Float64Array:
            values: Float64Array = slices[z - first].astype(np.float64)
            if values.shape == self._info.grid.shape_zyx[1:]:
                return values
            values -= self._padding
            for axis, (length, shift) in enumerate(
                zip(self._info.grid.shape_zyx[1:], self._beside_yx[z].tolist(), strict=True)
            ):
                values = moved_along(values, axis, shift, length)
            values += self._padding
            return values

        return moved


def moved_along(values: Float64Array, axis: int, shift: float, length: int) -> Float64Array:
    """Move values along an axis by `shift` ≥ 0 samples into an array of `length`, by linear interpolation.

    Beyond the ends of `values` lies 0.
    """
    source = np.moveaxis(values, axis, 0)
    target = np.zeros((length, *source.shape[1:]))
    whole = int(shift)
    part = shift - whole
    target[whole : whole + len(source)] = (1 - part) * source
    if part:
        target[whole + 1 : whole + 1 + len(source)] += part * source
    return np.moveaxis(target, 0, axis)


def _even_places(source: UnevenSource) -> tuple[Float64Array, float, GapRepair | None]:
    """Where each new slice lies, in numbers of the slices that are there; their distance; what that repairs."""
    along_mm = np.array(source.places.along_mm)
    gaps_mm = np.diff(along_mm)
    if "gaps" not in source.places.repairs:
        return np.arange(len(along_mm), dtype=np.float64), float(along_mm[-1]) / len(gaps_mm), None
    # The lower median: where distances mix, the slices of the finer part are kept.
    usual_mm = float(np.sort(gaps_mm)[(len(gaps_mm) - 1) // 2])
    count = min(round(float(along_mm[-1]) / usual_mm), _MOST_GROWTH * len(along_mm) + 1) + 1
    pitch_mm = float(along_mm[-1]) / (count - 1)
    between = np.interp(np.arange(count) * pitch_mm, along_mm, np.arange(len(along_mm)))
    # A slice that lies where a new one does is taken as it is.
    nearest = np.rint(between)
    between = np.where(np.abs(between - nearest) < 1e-6, nearest, between)
    between[-1] = len(along_mm) - 1
    repair = GapRepair(
        slices_before=len(along_mm), slices_after=count, usual_gap_mm=usual_mm, largest_gap_mm=float(gaps_mm.max())
    )
    return between, pitch_mm, repair


def _shifts(source: UnevenSource) -> Float64Array:
    """How far each slice lies beside the first along y and x, in pixels."""
    places, spacing_mm_zyx = source.places, source.nominal.grid.spacing_mm_zyx
    shifts: Float64Array = np.array(places.beside_mm_xy)[:, ::-1] / spacing_mm_zyx[1:]
    if "tilt" not in places.repairs:
        return np.zeros_like(shifts)
    shifts[:, np.abs(shifts).max(axis=0) <= _STRAIGHT_PIXELS] = 0.0
    return shifts


def _angle_deg(beside_mm: list[float], along_mm: tuple[float, ...]) -> float:
    return float(np.degrees(np.arctan2(beside_mm[-1], along_mm[-1])))


def _lowest(source: UnevenSource, progress: Progress) -> float:
    """Stored value whose physical value is the lowest."""
    nominal = source.nominal
    depth, rows, columns = nominal.grid.shape_zyx
    progress.start("finding the lowest value", depth)
    extremes = []
    reduce = np.fmin.reduce if nominal.slope > 0 else np.fmax.reduce
    for z0, z1 in slab_ranges(depth, rows * columns * np.dtype(nominal.stored_type).itemsize):
        extremes.append(float(reduce(source.slices.read_slab(z0, z1), axis=None)))
        progress.advance(z1 - z0)
    return float(reduce(extremes))
